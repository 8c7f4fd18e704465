"""Exceptions of the package. They correspond to those of the C++ library."""

import re

__all__ = [
    "Error", "BadInputError", "StaleHandleError", "NumericalError", "UndefinedResidualError", "NotObservableError",
    "InfeasibleError", "ResidualError", "BusyError", "Stopped", "MisfitError", "IncompleteWarning",
]


class Error(Exception):
    """Base of all exceptions of Tandem. The message names the thing, the problem and the remedy."""


class BadInputError(Error, ValueError):
    """An argument, an option or data are invalid. Nothing has been changed."""


class StaleHandleError(Error):
    """A variable or a block does not belong to the problem, or was removed from it."""


class NumericalError(Error, ArithmeticError):
    """A computation has no result at the present values."""


class UndefinedResidualError(NumericalError):
    """A residual is undefined or not finite. A residual of your own raises it to make the solver shorten the step."""


class NotObservableError(NumericalError):
    """A covariance does not exist, because no residual observes a direction of a variable.

    Attributes:
        state: name of the first variable that is not observable, for example "target 4".
        direction: its directions, for example "x, y".
        states: all of them in one text.
    """

    def __init__(self, message: str, states: str = "") -> None:
        super().__init__(message)
        self.states = states
        first = re.sub(r" \([^()]*\)$", "", states.split(";")[0])  # without the remedy
        self.state, _, self.direction = first.rpartition(" in ")


class InfeasibleError(NumericalError):
    """No point that meets the hard constraints was found.

    Attributes:
        constraints: descriptions of violated constraints, the worst one first.
    """

    def __init__(self, message: str, constraints: "tuple[str, ...]" = ()) -> None:
        super().__init__(message)
        self.constraints = tuple(constraints)


class ResidualError(Error):
    """A residual written in Python raised an exception, which is the cause of this one, or returned a wrong result."""


class BusyError(Error, RuntimeError):
    """A problem is used while another thread solves it. Use a copy, or wait."""


class Stopped(Error):
    """A computation was ended by its caller."""


class MisfitError(Error):
    """The data do not fit the model, and the run was strict. The attribute `result` has the result."""

    result: object = None


class IncompleteWarning(UserWarning):
    """A run has not converged or was stopped early; its result is the best so far."""
