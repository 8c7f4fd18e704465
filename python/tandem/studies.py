"""Monte Carlo studies."""

from typing import Any

from ._options import PathLike
from .results import Results


def run_study(study: PathLike, **options: Any) -> Results:
    """Runs all trials of a study: a YAML file, or the name of a built-in study.

    The keyword arguments are the options of `tandem study`, see help(tandem.study). The result has the summary of all
    trials. Give `out` to keep the study, resume it or export it later.

    >>> import os, tandem, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = os.path.join(folder, "study.yaml")
    ...     with open(file, "w") as study:
    ...         _ = study.write("name: noise\\nparameters: {minutes: 3, usbl_sigma: [1, 2]}\\nmodels: [mode-b]\\nseeds: 2\\n")
    ...     result = tandem.run_study(file)
    >>> "summary.csv" in result.files
    True
    """
    from . import _commands
    result: Results = _commands.study("run", study, **options)
    return result
