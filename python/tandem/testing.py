"""Checks for residuals of your own."""

from typing import Any

import numpy as np

from .vectors import Rn


def check_jacobians(residual: Any, *states: Any, step: float = 1e-6, tolerance: float = 1e-6) -> None:
    """Compares the Jacobians of a residual with central differences at these states.

    Args:
        residual: a residual of the library, or one made by tandem.residual or tandem.compiled_residual.
        states: group elements or arrays of them, one for each state.
        step: step of the right perturbations [m, rad].
        tolerance: largest allowed difference, relative to 1 + the largest entry.

    Raises:
        AssertionError: names the state, the row and the column of the largest difference.

    >>> import tandem
    >>> tandem.testing.check_jacobians(tandem.Prior(tandem.SE3()), tandem.SE3.exp([1, 2, 3, 0.1, 0.2, 0.3]))
    """
    elements = [s if hasattr(s, "dof") else Rn(s) for s in states]
    rows, jacobians = residual(*elements, jacobians=True)
    largest = max(np.abs(J).max(initial=0.0) for J in jacobians)
    for i, (state, J) in enumerate(zip(elements, jacobians)):
        for k in range(state.dof):
            unit = np.zeros(state.dof)
            unit[k] = step
            moved = [residual(*elements[:i], state.plus(sign * unit), *elements[i + 1:]) for sign in (1, -1)]
            numeric = (moved[0] - moved[1]) / (2 * step)
            difference = np.abs(numeric - J[..., k])
            worst = np.unravel_index(int(np.argmax(difference)), difference.shape)
            if not difference[worst] <= tolerance * (1 + largest):
                block = f" of block {worst[0]}" if len(worst) > 1 else ""
                raise AssertionError(
                    f"the Jacobian by state {i} ({type(state).__name__}) is {J[..., k][worst]:.9g} in row {worst[-1]} "
                    f"and column {k}{block}, but differences give {numeric[worst]:.9g}")
