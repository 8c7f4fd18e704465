"""Checks for residuals of your own."""

from typing import Any

import numpy as np

from . import _core


def check_jacobians(residual: Any, *states: Any, step: float = 1e-6, tolerance: float = 1e-6) -> None:
    """Compares the Jacobians of a residual with central differences at these states.

    Args:
        residual: a residual of the library, or one made by tandem.residual or tandem.compiled_residual.
        states: group elements, one for each state.
        step: step of the right perturbations [m, rad].
        tolerance: largest allowed difference, relative to 1 + the largest entry.

    Raises:
        AssertionError: names the state, the row and the column of the largest difference.

    >>> import tandem
    >>> tandem.testing.check_jacobians(tandem.Prior(tandem.SE3()), tandem.SE3.exp([1, 2, 3, 0.1, 0.2, 0.3]))
    """
    p = _core.Problem()
    x = [p.add(s, f"x{i}") for i, s in enumerate(states)]
    block = p.subject_to(residual, _core.between(-np.inf, np.inf), x)
    _, jacobian = p.linearization(block)
    first = 0
    for i, state in enumerate(states):
        for k in range(state.dof):
            unit = np.zeros(state.dof)
            unit[k] = step
            rows = []
            for sign in (1, -1):
                p.set_value(x[i], state.plus(sign * unit))
                rows.append(p.linearization(block)[0])
            p.set_value(x[i], state)
            numeric = (rows[0] - rows[1]) / (2 * step)
            difference = np.abs(numeric - jacobian[:, first + k])
            worst = int(np.argmax(difference))
            if not difference[worst] <= tolerance * (1 + np.abs(jacobian).max()):
                raise AssertionError(
                    f"the Jacobian by state {i} ({type(state).__name__}) is {jacobian[worst, first + k]:.9g} in row "
                    f"{worst} and column {k}, but differences give {numeric[worst]:.9g}")
        first += state.dof
