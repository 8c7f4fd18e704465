"""Monte Carlo studies."""

from typing import Any

from ._options import PathLike
from .results import Results


def run_study(study: PathLike, **options: Any) -> Results:
    """Runs all trials of a study: a YAML file, or the name of a built-in study.

    The keyword arguments are the options of `tandem study`, see help(tandem.study). The result has the summary of all
    trials. Give `out` to keep the study, resume it or export it later.
    """
    from . import _commands
    result: Results = _commands.study("run", study, **options)
    return result
