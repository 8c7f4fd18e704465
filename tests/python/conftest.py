"""Settings of the tests of the Python package, which run with PYTHONPATH on the package of the build folder."""

import numpy as np
import pytest

import tandem


@pytest.fixture(autouse=True)
def _names(doctest_namespace):
    doctest_namespace["np"] = np
    doctest_namespace["tandem"] = tandem


@pytest.fixture(scope="session")
def docking():
    """Estimate of the built-in scenario."""
    return tandem.estimate("docking_a")
