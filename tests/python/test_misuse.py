"""Wrong calls are one sentence each, and handles cannot dangle."""

import numpy as np
import pytest

import tandem
from tandem import R1, R2, R3, SE3

from test_problem import NOISE, SAMPLES, chain


@pytest.mark.parametrize("call, message", [
    (lambda: tandem.Interpolated(tandem.Prior(SE3()), 0.3), "not available for Prior; it takes Bearing, Range"),
    (lambda: tandem.SoftBound(tandem.Range(1.0), (1, 2, 3)), "bounds for 1 rows"),
    (lambda: tandem.Bundle(SE3(), R2([0, 0])), r"SE3 R3; SE3 R6; SE3 SE3; SE2 R3, not \(SE3, R2\)"),
    (lambda: tandem.Bundle(), "products"),
    (lambda: tandem.Bundle(SE3.identity(2), R3(np.zeros((3, 3)))), "2 and 3 elements"),
    (lambda: tandem.preintegrate_imu(SAMPLES[:1], **NOISE), "two samples"),
    (lambda: tandem.preintegrate_imu(SAMPLES[::-1], **NOISE), "time"),
    (lambda: tandem.preintegrate_imu(SAMPLES[:, :6]), r"\(7,\)"),
])
def test_bad_parts_of_residuals_are_one_sentence(call, message):
    with pytest.raises((ValueError, TypeError), match=message) as error:
        call()
    assert "\n" not in str(error.value)


def test_handles_of_other_problems_and_removed_variables_are_stale():
    p, x, blocks, _ = chain()
    q = tandem.Problem()
    for call in (lambda: q.value(x), lambda: q.minimize(tandem.Prior(SE3()), 1.0, x[0]), lambda: q.fix(x[0]),
                 lambda: q.multipliers(blocks[0]), lambda: q.remove(blocks[0]), lambda: q.remove(x[0])):
        with pytest.raises(tandem.StaleHandleError):
            call()
    extra = p.add(R1([0.0]), "extra")
    p.remove(extra)
    with pytest.raises(tandem.StaleHandleError, match="extra"):
        p.value(extra)


def test_handles_outlive_their_problem():
    p, x, blocks, _ = chain()
    del p
    assert repr(x[0]) and repr(blocks)
    with pytest.raises(tandem.StaleHandleError):
        tandem.Problem().value(x[0])


@pytest.mark.parametrize("call", [
    lambda p, x: p.minimize(tandem.Prior(R1([0.0])), None, x),
    lambda p, x: p.minimize(None, 1.0, x),
    lambda p, x: p.minimize(tandem.Prior(R1([0.0])), 1.0, None),
    lambda p, x: p.subject_to(tandem.Prior(R1([0.0])), None, x),
    lambda p, x: p.add(None),
    lambda p, x: p.solve(None),
    lambda p, x: tandem.Prior(None),
    lambda p, x: tandem.Marginals(None),
    lambda p, x: p.value(None),
])
def test_none_is_an_error(call):
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    with pytest.raises((TypeError, ValueError)):
        call(p, x)


@pytest.mark.parametrize("call, message", [
    (lambda p, x: p.minimize(tandem.Prior(R1([0.0])), [1.0, 2.0], x), r"shape \(\), \(1,\)"),
    (lambda p, x: p.minimize(tandem.Prior(R1([0.0])), -1.0, x), "positive"),
    (lambda p, x: p.minimize(tandem.Prior(R1([0.0])), np.nan, x), "NaN"),
    (lambda p, x: p.minimize(tandem.Prior(SE3()), 1.0, x), "SE3"),
    (lambda p, x: p.minimize(tandem.ConstantTwist(1.0, 1.0), 1.0, [x, x]), "R1, R1, R1"),
    (lambda p, x: p.subject_to(tandem.Prior(R1([0.0])), (2.0, 1.0), x), "bound"),
    (lambda p, x: p.subject_to(tandem.Prior(R1([0.0])), (np.nan, 1.0), x), "NaN"),
    (lambda p, x: p.solve("newton"), "newton"),
    (lambda p, x: p.solve(max_iterations="many"), "max_iterations"),
    (lambda p, x: p.add(R1([np.nan])), "NaN"),
    (lambda p, x: p.set_value(x, SE3()), "R1"),
    (lambda p, x: tandem.TwistComponents(1.0, "swai"), "swai"),
    (lambda p, x: p.minimize(tandem.Prior(R1([0.0])), tandem.Gaussian.covariance(np.ones((2, 1, 1))), [x]),
     "noises of 2 blocks for 1 blocks"),
    (lambda p, x: p.minimize(tandem.Prior(R1([0.0])), tandem.Gaussian([1.0, 1.0]), x), "noise of 1 rows, not of 2"),
    (lambda p, x: tandem.Gaussian.information([np.eye(2), -np.eye(2)]), "matrix 1 of 2: "),
    (lambda p, x: tandem.Gaussian.covariance(np.ones((2, 2, 3))), r"\(dim, dim\) or \(n, dim, dim\), not \(2, 2, 3\)"),
    (lambda p, x: p.subject_to(tandem.Prior(R1([0.0])), ([[0.0], [1.0]], None), [[x, x, x]]),
     "bounds of 2 blocks for 3 blocks"),
    (lambda p, x: tandem.between([[0.0], [1.0]], [[1.0]]), "lower bounds of 2 and upper bounds of 1 blocks"),
    (lambda p, x: tandem.between([[0.0], [1.0]], 0.5), "no number is between the lower bound 1.0 and"),
])
def test_bad_input_is_one_sentence(call, message):
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    before = p.statistics
    with pytest.raises((ValueError, TypeError), match=message) as error:
        call(p, x)
    assert "\n" not in str(error.value)
    assert p.statistics == before


@pytest.mark.parametrize("call, error, message", [
    (lambda p, x: p.solve(max_iterations=-1), ValueError, "max_iterations"),
    (lambda p, x: p.solve(time_limit=np.nan), ValueError, "time_limit"),
    (lambda p, x: p.solve(progress=3), TypeError, "progress: expected a function"),
    (lambda p, x: p.solve(threads=-1), ValueError, "threads"),
    (lambda p, x: tandem.Planner(tandem.Vehicle("remus_100"), steps=3, deadline=-1), ValueError, "deadline"),
    (lambda p, x: tandem.Planner(tandem.Vehicle("remus_100"), steps=3, deadline=np.nan), ValueError, "deadline"),
    (lambda p, x: tandem.Calibration(p, {"a": (p.blocks[0], -1)}), ValueError, "group a: row -1 of a block with . rows"),
    (lambda p, x: tandem.Calibration(p, {"a": p.blocks[0]}, priors={"a": None}), TypeError, "prior of a is a number"),
    (lambda p, x: tandem.Problem.read("/nonexistent.json"), ValueError, "nonexistent"),
    (lambda p, x: SE3.exp([np.inf] * 6), ValueError, "infinity"),
    (lambda p, x: SE3.from_matrix(np.diag([1, 1, 1, 2])), ValueError, "last row"),
    (lambda p, x: SE3().interpolate(SE3(), np.nan), ValueError, "NaN"),
    (lambda p, x: x[["a"]], TypeError, "a boolean mask or a list of integers"),
    (lambda p, x: x[[True]], IndexError, "the mask has shape .* but there are 20 elements"),
    (lambda p, x: x[[20]], IndexError, "index 20 is outside"),
    (lambda p, x: SE3.identity(3)[[5]], IndexError, "index 5 is outside"),
    (lambda p, x: SE3.identity(3)[1.0], TypeError, "a boolean mask or a list of integers"),
    (lambda p, x: tandem.TwistComponents(1.0, 3), ValueError, "axes are a text"),
    (lambda p, x: tandem.Scenario("x", noise=3), ValueError, "noise: expected a dictionary"),
    (lambda p, x: tandem.FixedLag(windw=3), TypeError, "the options are window"),
    (lambda p, x: tandem.Bearing(0.2), ValueError,
     r"bearing: expected .*\(3,\) or \(n, 3\) for states SE3, or .*\(2,\) or \(n, 2\) for states SE2, not a single number$"),
    (lambda p, x: tandem.Prior("a"), ValueError, "expected a value of SE3, SE2, SO3, SO2, SE23, R1, R2, R3, .* not str"),
    (lambda p, x: tandem.Prior(2 * np.eye(3)[None]), ValueError, "the matrix is not a rotation"),
    (lambda p, x: SE3.exp(np.array([None] * 6)), ValueError, r"real numbers of shape \(6,\) or \(n, 6\), not .* object"),
    (lambda p, x: SE3.exp(np.array(["1"] * 6)), ValueError, r"real numbers of shape \(6,\) or \(n, 6\), not .* <U1"),
    (lambda p, x: SE3.from_matrix(np.eye(4, dtype=complex)), ValueError, r"\(4, 4\) or \(n, 4, 4\), not .* complex128"),
    (lambda p, x: SE3(np.eye(3, dtype=object), [0, 0, 0]), ValueError, r"\(3, 3\) or \(n, 3, 3\), not .* object"),
    (lambda p, x: tandem.FitReport(p), TypeError, "FitReport: expected .* not Problem; use tandem.fit_report"),
    (lambda p, x: tandem.Summary(None), TypeError, "expected a dictionary, not NoneType"),
    (lambda p, x: R3(np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])), ValueError, "not an array with masked entries"),
    (lambda p, x: p[0], TypeError, "expected the name of a variable, not int"),
    (lambda p, x: tandem.fit_report(p, None), TypeError, "fit_report: expected a Problem and a dictionary"),
    (lambda p, x: tandem.StudentT(3.0, -9), ValueError, "number of rows, at least 1, not -9"),
    (lambda p, x: p.solve(None), TypeError, r"^solve: expected solve\(solver='auto', \*, .*option=value, ...\), not \(NoneType\)$"),
    (lambda p, x: p.solve("damped-sqp", graduated=True), ValueError, "cannot be graduated"),
    (lambda p, x: p.solve("damped-sqp", patience=-1), ValueError, "patience"),
])
def test_misuse_is_one_sentence(call, error, message):
    p, x, *_ = chain()
    with pytest.raises(error, match=message) as raised:
        call(p, x)
    assert "\n" not in str(raised.value)


def test_an_exception_of_progress_names_progress():
    def progress(state):
        raise ValueError("full disk")

    p, *_ = chain()
    with pytest.raises(tandem.ResidualError, match="^progress: the function raised ValueError: full disk"):
        p.solve(progress=progress)


def uses(thing):
    """Reads all properties of an object and calls all of its methods without arguments."""
    for name in dir(type(thing)):
        if name.startswith("__") and name not in ("__len__", "__repr__", "__copy__", "__getstate__", "__iter__"):
            continue
        try:
            member = getattr(thing, name)
            if callable(member) and not isinstance(member, type):
                member()
        except (TypeError, ValueError):
            pass


def test_objects_that_are_not_initialised_are_type_errors():
    for kind in vars(tandem._core).values():
        if isinstance(kind, type) and not issubclass(kind, BaseException):
            uses(kind.__new__(kind))
    p, x, *_ = chain()
    for call in (lambda: tandem.Problem.__new__(tandem.Problem).cost(), lambda: SE3.__new__(SE3).log(),
                 lambda: p.minimize(tandem.Prior(SE3()), 1.0, tandem.Variable.__new__(tandem.Variable)),
                 lambda: p.minimize(tandem.Residual.__new__(tandem.Residual), 1.0, x[0]),
                 lambda: p.minimize(tandem.Prior(SE3()), tandem.Gaussian.__new__(tandem.Gaussian), x[0]),
                 lambda: p.value(x[0]).minus(SE3.__new__(SE3)), lambda: tandem.Prior(SE3.__new__(SE3))):
        with pytest.raises(TypeError, match="not initialised"):
            call()
    before = p.cost()
    p.__setstate__(tandem.Problem().__getstate__())  # has no effect on an object that exists
    p.__init__()
    assert p.cost() == before


def test_unknown_solver_options_are_type_errors():
    p, *_ = chain()
    with pytest.raises(TypeError, match="max_iteration; the options are"):
        p.solve(max_iteration=3)


def test_every_order_of_setup_is_an_error_or_works():
    p = tandem.Problem()
    assert p.solve().status in ("converged", "unsupported", "failed")
    with pytest.raises((tandem.Error, ValueError)):
        tandem.Marginals(p)
    x = p.add(R1([0.0]), "x")
    p.fix(x)
    p.solve()
    p.fix(x, False)
    assert p.solve() is not None


def test_temporaries_stay_alive():
    x = tandem.Problem().add(R1([0.0]), "x")
    assert x.name == "x"
    lag_problem = tandem.FixedLag().problem
    assert lag_problem.add(R1([0.0]), "y").name == "y"
    marginals = (lambda: (lambda p: (p.minimize(tandem.Prior(R1([0.0])), 1.0, p.add(R1([0.0]), "z")),
                                     tandem.Marginals(p))[1])(tandem.Problem()))()
    assert repr(marginals)


@pytest.mark.parametrize("call, message", [
    (lambda: tandem.preintegrate_imu(SAMPLES), "accelerometer is missing"),
    (lambda: tandem.preintegrate_imu(SAMPLES, **{**NOISE, "gyroscope": np.nan}), "gyroscope|noises"),
    (lambda: tandem.preintegrate_imu(SAMPLES, **{**NOISE, "accelerometer": -1e-3}), "not negative"),
    (lambda: tandem.predict_target(SE3(), SE3(), 1.0, noise=-np.ones(6), step=1.0, steps=1), "not be negative"),
    (lambda: tandem.predict_target(SE3(), SE3(), 1.0, noise=np.ones(6), step=1.0, steps=-3), "not be negative"),
    (lambda: tandem.predict_target(SE3(), SE3(), 1.0, noise=np.ones(6), step=1.0, steps=1, covariance=-np.eye(12)),
     "negative variance"),
])
def test_bad_numbers_of_sensors_and_predictions_are_refused(call, message):
    with pytest.raises((tandem.BadInputError, TypeError, ValueError), match=message):
        call()


def test_names_with_parentheses_and_prepositions_are_kept_in_errors():
    error = tandem.NotObservableError("no", "camera (left) in use 4 in x, y (add a residual, or fix it); b in x")
    assert (error.state, error.direction) == ("camera (left) in use 4", "x, y")


def test_a_problem_is_displayed_although_a_residual_is_undefined():
    p = tandem.Problem()
    x, y = p.add(SE3(), "x"), p.add(R3(np.zeros(3)), "y")
    p.minimize(tandem.Bearing([1.0, 0, 0]), 0.1, [x, y])
    assert "<svg" in p._repr_html_()
