"""Prints generated parts of the documentation: `python3 -m tandem._reference`."""

import math
from typing import Any, Dict, List

from ._core import _solver_options


def _text(value: Any) -> str:
    if isinstance(value, float) and math.isinf(value):
        return "inf"
    return f"{value:g}" if isinstance(value, float) else str(value) if not isinstance(value, str) else f'"{value}"'


def solver_options() -> str:
    """Returns a table of the options of the solvers: an option in each row, its default for each solver.

    >>> print(solver_options().splitlines()[0])
    | option | gauss-newton | augmented-lagrangian | damped-sqp | ipopt | nlopt:ALGORITHM |
    """
    by_solver: Dict[str, Dict[str, Any]] = _solver_options()
    names: List[str] = []
    for options in by_solver.values():
        names += [name for name in options if name not in names]
    lines = ["| option | " + " | ".join(by_solver) + " |", "| --- " * (1 + len(by_solver)) + "|"]
    for name in names:
        cells = [_text(options[name]) if name in options else "" for options in by_solver.values()]
        lines.append(f"| `{name}` | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(solver_options())
