"""Residuals of one's own: in Python, batched, and compiled."""

import ctypes
import gc
import threading
import weakref

import numpy as np
import pytest

import tandem
from tandem import R1, R2, SE3


def relative(x, y, z=SE3.exp([1, 0, 0, 0, 0, 0.1]), *, jacobians=False):
    """Relative pose with given Jacobians, for single elements and arrays."""
    e = (z.inverse() @ x.inverse() @ y).log()
    if not jacobians:
        return e
    by_y = SE3.jr_inv(e)
    return e, [-by_y @ (y.inverse() @ x).adjoint(), by_y]


def problem_with(make, n=30):
    """A chain with one relative pose between neighbours: the library's if `make` is None."""
    p = tandem.Problem()
    z = SE3.exp([1, 0, 0, 0, 0, 0.1])
    x = p.add(SE3.exp(np.random.default_rng(3).normal(scale=0.3, size=(n, 6))), "x")
    p.minimize(tandem.Prior(SE3()), 0.1, x[0])
    p.minimize(tandem.RelativePose(z) if make is None else make(), 0.1, [x[:-1], x[1:]])
    return p, x


@pytest.mark.parametrize("jacobian", ["given", "difference"])
@pytest.mark.parametrize("batched", [False, True])
def test_python_residuals_equal_those_of_the_library(jacobian, batched):
    function = relative if jacobian == "given" else lambda x, y: relative(x, y)
    p, x = problem_with(lambda: tandem.residual(function, dim=6, jacobian=jacobian, batched=batched, name="mine"))
    q, y = problem_with(None)
    a, b = p.solve(), q.solve()
    assert a.cost == pytest.approx(b.cost, abs=1e-9)
    assert np.allclose(p.value(x).minus(q.value(y)), 0, atol=1e-5)


def test_batched_residuals_need_one_call_for_each_evaluation():
    calls = []

    def counted(x, y, *, jacobians=False):
        calls.append(len(x))
        return relative(x, y, jacobians=jacobians)

    p, _ = problem_with(lambda: tandem.residual(counted, dim=6, jacobian="given", batched=True))
    summary = p.solve(observability=False)
    assert set(calls) == {29}
    assert len(calls) <= 3 * (summary.evaluations + summary.iterations + 2)


def test_batched_residuals_get_their_data():
    data = np.arange(10.0)
    f = tandem.residual(lambda x, d: x - d[:, None], dim=1, batched=True, data=data)
    p = tandem.Problem()
    x = p.add(R1(np.zeros((10, 1))), "x")
    blocks = p.minimize(f, 1.0, x)
    p.solve()
    assert np.allclose(p.value(x).vector[:, 0], data, atol=1e-6)
    p.remove(blocks[0])
    assert p.solve().converged


def test_complex_steps_are_exact():
    f = tandem.residual(lambda x: np.array([np.exp(x[0]) * np.sin(x[1])]), dim=1, jacobian="complex")
    p = tandem.Problem()
    x = p.add(R2([0.3, 0.7]), "x")
    block = p.minimize(f, 1.0, x)
    r, J = p.linearization(block)
    assert np.allclose(J, [[np.exp(0.3) * np.sin(0.7), np.exp(0.3) * np.cos(0.7)]], rtol=1e-14)


def test_a_constraint_of_ones_own_is_three_lines():
    p = tandem.Problem()
    x = p.add(R2([2.0, 0.5]), "x")
    p.minimize(tandem.Prior(R2([2.0, 0.0])), 1.0, x)

    @tandem.residual(dim=1)
    def circle(x):
        return x @ x

    p.subject_to(circle, tandem.equal_to(1.0), x)
    assert p.solve().converged
    assert np.allclose(p.value(x).vector, [1, 0], atol=1e-5)


def test_jacobians_of_the_library_inside_ones_own_residual():
    prior = tandem.Prior(SE3.exp([0.1, 0.2, 0.3, 0.1, 0, 0]))

    def twice(x, *, jacobians=False):
        if not jacobians:
            return 2 * prior(x)
        r, (J,) = prior(x, jacobians=True)
        return 2 * r, [2 * J]

    tandem.testing.check_jacobians(tandem.residual(twice, dim=6, jacobian="given"), SE3.exp([1, 2, 3, 0.3, 0.2, 0.1]))


def test_wrong_jacobians_are_found():
    def wrong(x, *, jacobians=False):
        return (x, [2 * np.eye(2)]) if jacobians else x

    with pytest.raises(AssertionError, match="state 0"):
        tandem.testing.check_jacobians(tandem.residual(wrong, dim=2, jacobian="given"), R2([1.0, 2.0]))


@pytest.mark.parametrize("threads", [1, 4])
def test_exceptions_are_chained_with_their_traceback(threads):
    calls = []

    def fails(x):
        calls.append(1)
        if len(calls) > 5:
            raise ZeroDivisionError("at the sixth call")
        return x - 1e3 * np.ones(1)

    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.residual(fails, dim=1, name="fails"), 1.0, x)
    with pytest.raises(tandem.ResidualError, match="fails.*ZeroDivisionError: at the sixth call") as error:
        for _ in range(10):
            p.set_value(x, R1([float(len(calls))]))
            p.solve(threads=threads)
    cause = error.value.__cause__
    assert isinstance(cause, ZeroDivisionError) and cause.__traceback__ is not None
    assert np.isfinite(p.value(x).vector).all()


@pytest.mark.parametrize("solver", ["gauss-newton", "augmented-lagrangian", "ipopt", "nlopt:lbfgs"])
def test_exceptions_pass_every_solver(solver):
    def fails(x):
        raise LookupError("always")

    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.residual(fails, dim=1), 1.0, x)
    with pytest.raises(tandem.Error):
        p.solve(solver).require_converged()


def test_interrupt_within_a_residual_returns_the_best_point():
    import _thread
    calls = []

    def slow(x):
        calls.append(1)
        if len(calls) == 5:
            _thread.interrupt_main()
        return np.sin(x) + 2

    p = tandem.Problem()
    x = p.add(R1([3.0]), "x")
    p.minimize(tandem.residual(slow, dim=1), 1.0, x)
    summary = p.solve(gradient_tolerance=1e-300, cost_tolerance=0.0, step_tolerance=0.0)
    assert summary.status == "interrupted" and np.isfinite(summary.cost)


@pytest.mark.parametrize("compute", [lambda p: p.cost(), lambda p: tandem.fit_report(p, {}), tandem.Marginals])
def test_interrupt_outside_of_solvers_is_keyboard_interrupt(compute):
    def interrupted(x):
        raise KeyboardInterrupt

    p = tandem.Problem()
    p.minimize(tandem.residual(interrupted, dim=1), 1.0, p.add(R1([0.0])))
    with pytest.raises(KeyboardInterrupt):
        compute(p)


def test_residuals_may_read_their_problem():
    p = tandem.Problem()
    x, y = p.add(R1([0.0])), p.add(R1([2.0]))
    p.fix(y)
    p.minimize(tandem.residual(lambda v: v - p.value(y).vector, dim=1), 0.5, x)
    assert p.solve().converged and p.value(x).vector == pytest.approx([2.0])
    assert tandem.Marginals(p).covariance(x) == pytest.approx(np.array([[0.25]]))


def test_wrong_sizes_name_the_size_wanted():
    p = tandem.Problem()
    x = p.add(R2([0.0, 0.0]), "x")
    p.minimize(tandem.residual(lambda x: np.zeros(3), dim=2, name="mine"), 1.0, x)
    with pytest.raises(tandem.ResidualError) as error:
        p.solve()
    assert "mine" in str(error.value) and "(3,)" in str(error.value) + str(error.value.__cause__)


def test_nan_shortens_the_step():
    def root(x):
        with np.errstate(invalid="ignore"):
            return np.sqrt(x) - 0.1

    p = tandem.Problem()
    x = p.add(R1([4.0]), "x")
    p.minimize(tandem.residual(root, dim=1), 1.0, x)
    p.solve()
    assert p.value(x).vector[0] == pytest.approx(0.01, abs=1e-4)


def test_nan_at_the_start_is_named():
    p = tandem.Problem()
    x = p.add(R1([1.0]), "x")
    p.minimize(tandem.residual(lambda x: x * np.nan, dim=1, name="mine"), 1.0, x)
    summary = p.solve()
    assert not summary.converged and "mine of x" in summary.message


@tandem.residual(dim=1)
def circle(x):
    return x[0] ** 2 + x[1] ** 2


class Offset:
    """A residual with parameters of its own."""

    def __init__(self, z):
        self.z = np.asarray(z)

    def __call__(self, x):
        return x - self.z


def test_problems_with_importable_residuals_are_pickled():
    import copy
    import pickle
    p, x = problem_with(lambda: tandem.residual(relative, dim=6, jacobian="given", batched=True))
    y = p.add(tandem.R2([1.0, 0.5]), "y")
    p.minimize(tandem.residual(Offset([2.0, 0.0]), dim=2), [1.0, 2.0], y, loss=tandem.Huber(3.0))
    constraint = p.subject_to(circle, tandem.equal_to(1.0), y)
    for q in (copy.deepcopy(p), pickle.loads(pickle.dumps(p)), pickle.loads(pickle.dumps(copy.copy(p)))):
        assert q.statistics == p.statistics
        summary = q.solve()
        assert summary.converged
        assert summary.cost == pytest.approx(p.copy().solve().cost, rel=1e-9)
    p.solve()
    again = pickle.loads(pickle.dumps(p))
    hard = [b for b in again.blocks if "circle" in repr(b)]
    assert np.allclose(again.multipliers(hard[0]), p.multipliers(constraint), atol=1e-12)
    p.remove(constraint)
    assert pickle.loads(pickle.dumps(p)).statistics["constraints"] == 0


def test_residuals_that_cannot_be_imported_are_not_pickled(tmp_path):
    import pickle
    for residual, message in ((tandem.residual(lambda x: x, dim=1, name="mine"), "mine.*not importable.*top level"),
                              (tandem.compiled_residual(_line, dim=1, data=[0.0], name="fast"), "fast.*compiled")):
        p = tandem.Problem()
        p.minimize(residual, 1.0, p.add(R1([0.0]), "x"))
        with pytest.raises(tandem.BadInputError, match=message) as error:
            pickle.dumps(p)
        assert "\n" not in str(error.value)
        with pytest.raises(tandem.BadInputError, match="of x.*pickle"):
            p.write(tmp_path / "problem.json")
        assert not (tmp_path / "problem.json").exists()


def test_functions_live_as_long_as_their_problem():
    def make():
        offset = np.array([3.0])
        return tandem.residual(lambda x: x - offset, dim=1)

    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(make(), 1.0, x)
    p.solve()
    assert p.value(x).vector[0] == pytest.approx(3.0)


@pytest.mark.parametrize("jacobian", ["difference", "complex"])
def test_residuals_may_change_their_arguments_in_place(jacobian):
    def shifted(x):
        x -= 1.0
        return x**2 - 4

    p = tandem.Problem()
    x = p.add(R1([2.0]))
    p.minimize(tandem.residual(shifted, dim=1, jacobian=jacobian), 0.1, x)
    p.solve()
    assert p.value(x).vector == pytest.approx([3.0])
    assert tandem.Marginals(p).covariance(x) == pytest.approx(np.array([[0.1**2 / 4**2]]), rel=1e-5)


def test_residuals_are_released_with_their_blocks():
    alive = weakref.WeakSet()

    def moved(by):
        f = lambda x, y: y - x - by
        alive.add(f)
        return tandem.residual(f, dim=1)

    lag = tandem.FixedLag(window=5.0)
    x = lag.add(0.0, R1([0.0]))
    lag.problem.minimize(tandem.Prior(R1([0.0])), 1.0, x)
    for k in range(1, 30):
        y = lag.add(float(k), R1([0.0]))
        block = lag.problem.minimize(moved(1.0), 0.1, (x, y))
        x = y
        assert lag.update().converged
    gc.collect()
    assert len(alive) <= 6
    lag.problem.remove(block)
    gc.collect()
    assert len(alive) <= 5


def test_residuals_in_two_threads():
    results = []

    def run():
        p, x = problem_with(lambda: tandem.residual(relative, dim=6, jacobian="given", batched=True))
        results.append(p.solve().cost)

    threads = [threading.Thread(target=run) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(results)) == 1


SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.POINTER(ctypes.c_double)] * 4, ctypes.c_int)


@SIGNATURE
def _line(data, x, r, J, jacobians):
    r[0] = x[0] - data[0]
    if jacobians:
        J[0] = 1.0
    return 0


def test_ctypes_functions():
    p = tandem.Problem()
    x = p.add(R1(np.zeros((5, 1))), "x")
    p.minimize(tandem.compiled_residual(_line, dim=1, data=np.arange(5.0)[:, None]), 1.0, x)
    assert p.solve(threads=1).converged
    assert np.allclose(p.value(x).vector[:, 0], np.arange(5.0), atol=1e-9)


def test_numba_functions():
    numba = pytest.importorskip("numba")
    pointer = numba.types.CPointer(numba.types.float64)

    @numba.cfunc(numba.types.int32(pointer, pointer, pointer, pointer, numba.types.int32))
    def line(data, x, r, J, jacobians):
        r[0] = x[0] - data[0]
        if jacobians:
            J[0] = 1.0
        return 0

    p = tandem.Problem()
    x = p.add(R1(np.zeros((1000, 1))), "x")
    p.minimize(tandem.compiled_residual(line, dim=1, data=np.arange(1000.0)[:, None]), 1.0, x)
    assert p.solve().converged
    assert np.allclose(p.value(x).vector[:, 0], np.arange(1000.0), atol=1e-9)


@pytest.mark.parametrize("call, message", [
    (lambda: tandem.residual(3, dim=1), "function"),
    (lambda: tandem.residual(abs, dim=0), "dim"),
    (lambda: tandem.residual(abs, dim=1, jacobian="exact"), "jacobian"),
    (lambda: tandem.residual(abs, dim=1, data=np.zeros(3)), "batched"),
    (lambda: tandem.compiled_residual(abs, dim=1), "cfunc"),
    (lambda: tandem.compiled_residual(_line, dim=1, data=np.full(3, np.nan)), "NaN"),
    (lambda: tandem.compiled_residual(_line, dim=1, data=np.zeros((0, 1))), "empty"),
    (lambda: tandem.compiled_residual(_line, dim=1, data=[]), "empty"),
])
def test_bad_definitions_are_one_sentence(call, message):
    with pytest.raises(tandem.BadInputError, match=message):
        call()


@pytest.mark.parametrize("function, allowed", [
    (lambda x: x[:1] ** 2 + x[1:], True),
    (lambda x: np.array([3.0]), True),
    (lambda x: np.linalg.norm(x)[None], False),
    (lambda x: np.abs(x[:1]), False),
    (lambda x: x[:1] + np.abs(x[1:]), False),
    (lambda x: np.array([float(np.real(x[0]))]), False),
])
def test_complex_steps_that_lose_the_imaginary_part_are_an_error(function, allowed):
    p = tandem.Problem()
    x = p.add(R2([1.0, 2.0]), "x")
    p.minimize(tandem.residual(function, dim=1, jacobian="complex", name="mine"), 1.0, x)
    p.minimize(tandem.Prior(R2([0.0, 0.0])), 1.0, x)
    if allowed:
        assert p.solve().converged
        return
    with pytest.raises(tandem.ResidualError, match="mine: .*np.linalg.norm, abs, max"):
        p.solve()


def test_residuals_of_ones_own_are_functions():
    @tandem.residual(dim=1)
    def altitude(x):
        return x.translation[2:]

    x = SE3.exp([1, 2, 3, 0, 0, 0])
    assert altitude(x) == pytest.approx([3.0])
    rows, (J,) = altitude(x, jacobians=True)
    assert rows.shape == (1,) and np.allclose(J, [[0, 0, 1, 0, 0, 0]], atol=1e-8)
    assert altitude(SE3.identity(4)).shape == (4, 1)
    tandem.testing.check_jacobians(altitude, x)
    double = tandem.residual(lambda y: 2 * y, dim=2)
    assert np.allclose(double([1.0, 2.0]), [2, 4]) and np.allclose(double(R2([1.0, 2.0])), [2, 4])
    batched = tandem.residual(relative, dim=6, jacobian="given", batched=True)
    y = SE3.exp(np.random.default_rng(1).normal(size=(3, 6)))
    tandem.testing.check_jacobians(batched, SE3.identity(3), y)
    wrong = tandem.residual(lambda y, jacobians=False: (y, [np.zeros((len(y), 2, 2))]) if jacobians else y, dim=2,
                            jacobian="given", batched=True)
    with pytest.raises(AssertionError, match="column 0 of block 0"):
        tandem.testing.check_jacobians(wrong, R2(np.ones((3, 2))))


def test_data_are_copied_and_finite():
    data = np.arange(3.0)
    f = tandem.residual(lambda x, d: x - d[:, None], dim=1, batched=True, data=data)
    p = tandem.Problem()
    x = p.add(R1(np.zeros((3, 1))), "x")
    p.minimize(f, 1.0, x)
    data += 100
    q = p.copy()
    assert q.cost() == pytest.approx(2.5)
    with pytest.raises(tandem.BadInputError, match="NaN"):
        tandem.residual(lambda x, d: x, dim=1, batched=True, data=np.array([0.0, np.nan]))


@pytest.mark.parametrize("batched", [False, True])
def test_data_that_a_residual_reads_may_change_between_computations(batched):
    reference, gain = np.array([0.0]), [1.0]
    p = tandem.Problem()
    x = p.add(tandem.R1([0.0]), "x")
    block = p.minimize(tandem.residual(lambda x: gain[0] * (x - reference), dim=1, batched=batched), 1.0, x)
    p.solve()
    reference[0] = 1.0
    assert p.cost() == 0.5
    assert p.linearization(block)[0] == -1.0
    assert p.solve().converged and p.value(x).vector == pytest.approx([1.0])
    gain[0] = 10.0
    assert tandem.Marginals(p).covariance(x) == pytest.approx(np.array([[0.01]]))


@pytest.mark.parametrize("function", ["my_function", b"my_function", True, ctypes.c_char_p(b"my_function"), -1])
def test_only_pointers_to_functions_are_compiled_residuals(function):
    with pytest.raises(tandem.BadInputError, match="compiled_residual: expected"):
        tandem.compiled_residual(function, dim=1)
