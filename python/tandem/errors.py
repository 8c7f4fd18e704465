"""Exceptions of the package. They correspond to those of the C++ library."""

import re

__all__ = [
    "Error", "BadInputError", "StaleHandleError", "NumericalError", "UndefinedResidualError", "NotObservableError",
    "InfeasibleError", "ResidualError", "BusyError", "Stopped", "MisfitError", "IncompleteWarning",
]


class Error(Exception):
    """Base of all exceptions of Tandem. The message names the thing, the problem and the remedy.

    >>> import tandem
    >>> try:
    ...     tandem.info("nowhere")
    ... except tandem.Error as error:
    ...     print(error)
    there is no folder 'nowhere' and no built-in scenario of that name (built in: docking_a)
    """


class BadInputError(Error, ValueError):
    """An argument, an option or data are invalid. Nothing has been changed.

    >>> import tandem
    >>> tandem.Rn([0.0] * 7)
    Traceback (most recent call last):
    tandem.errors.BadInputError: Rn: vectors have 1, 2, 3, 4, 5, 6, 8, 9, 12 entries, not 7
    """


class StaleHandleError(Error):
    """A variable or a block does not belong to the problem, or was removed from it.

    >>> import tandem
    >>> x = tandem.Problem().add(tandem.R1([0.0]), "x")
    >>> tandem.Problem().value(x)
    Traceback (most recent call last):
    tandem.errors.StaleHandleError: ...
    """


class NumericalError(Error, ArithmeticError):
    """A computation has no result at the present values.

    >>> import tandem
    >>> p = tandem.Problem()
    >>> p.multipliers(p.subject_to(tandem.Prior(tandem.R1([0.0])), tandem.equal_to(0), p.add(tandem.R1([0.0]))))
    Traceback (most recent call last):
    tandem.errors.NumericalError: multipliers: the problem has not been solved; call solve() first
    """


class UndefinedResidualError(NumericalError):
    """A residual is undefined or not finite. A residual of your own raises it to make the solver shorten the step.

    >>> import tandem
    >>> @tandem.residual(dim=1)
    ... def inverse(x):
    ...     if x[0] <= 0:
    ...         raise tandem.UndefinedResidualError("x must be positive")
    ...     return [1 / x[0]]
    >>> inverse(tandem.R1([2.0]))
    array([0.5])
    """


class NotObservableError(NumericalError):
    """A covariance does not exist, because no residual observes a direction of a variable.

    Attributes:
        state: name of the first variable that is not observable, for example "target 4".
        direction: its directions, for example "x, y".
        states: all of them in one text.

    >>> import tandem
    >>> p = tandem.Problem()
    >>> x = p.add(tandem.R2([1, 1]), "x")
    >>> cost = p.minimize(tandem.Range(1.0), 1.0, [p.add(tandem.R2([1, 0]), "origin"), x])
    >>> try:
    ...     tandem.Marginals(p).require_regular()
    ... except tandem.NotObservableError as error:
    ...     print(error.state, "in", error.direction)
    x in x, y
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

    >>> import tandem, warnings
    >>> p = tandem.Problem()
    >>> x = p.add(tandem.R1([0.0]), "x")
    >>> blocks = [p.subject_to(tandem.Prior(tandem.R1([z])), tandem.equal_to(0), x) for z in (1.0, 2.0)]
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", tandem.IncompleteWarning)
    ...     summary = p.solve()
    >>> try:
    ...     summary.require_converged()
    ... except tandem.InfeasibleError as error:
    ...     print(len(error.constraints))
    2
    """

    def __init__(self, message: str, constraints: "tuple[str, ...]" = ()) -> None:
        super().__init__(message)
        self.constraints = tuple(constraints)


class ResidualError(Error):
    """A residual written in Python raised an exception, which is the cause of this one, or returned a wrong result.

    >>> import tandem
    >>> tandem.residual(lambda x: [1 / 0], dim=1, name="broken")(tandem.R1([2.0]))
    Traceback (most recent call last):
    tandem.errors.ResidualError: broken: the residual raised ZeroDivisionError: division by zero
    """


class BusyError(Error, RuntimeError):
    """A problem is used while another thread solves it, or changed by its own solve. Use a copy, or wait.

    >>> import tandem
    >>> p = tandem.Problem()
    >>> x = p.add(tandem.R1([0.0]))
    >>> block = p.minimize(tandem.residual(lambda v: p.fix(x) or [0.0], dim=1, name="fixing"), 1.0, x)
    >>> try:
    ...     p.solve()
    ... except tandem.ResidualError as error:
    ...     isinstance(error.__cause__, tandem.BusyError)
    True
    """


class Stopped(Error):
    """A computation was ended by its caller, or not started because Python exits.

    >>> import tandem
    >>> issubclass(tandem.Stopped, tandem.Error)
    True
    """


class MisfitError(Error):
    """The data do not fit the model, and the run was strict. The attribute `result` has the result.

    >>> import tandem
    >>> try:
    ...     tandem.estimate("docking_a", max_keyframes=60, noise={"usbl": [0.01] * 3}, strict=True)
    ... except tandem.MisfitError as error:
    ...     error.result.fit.consistent
    False
    """

    result: object = None


class IncompleteWarning(UserWarning):
    """A run has not converged or was stopped early; its result is the best so far.

    >>> import tandem, warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     result = tandem.estimate("docking_a", max_keyframes=60, max_iterations=1)
    >>> caught[0].category is tandem.IncompleteWarning, bool(result.incomplete)
    (True, True)
    """
