"""Blocks of problems: their noise and bounds, changes in place, and removal."""

import gc
import pickle
import weakref

import numpy as np
import pytest

import tandem
from tandem import R1, R2, R3, SE3

from chains import chain


def test_removals_are_complete_or_nothing():
    p, x, blocks, _ = chain()
    p.remove(blocks[3])
    assert not p.has(blocks[3]) and p.has(blocks[4]) and not p.has(blocks) and p.has(blocks[4:7])
    with pytest.raises(tandem.StaleHandleError, match="block 3 of the 19"):
        p.remove(blocks)
    assert p.statistics["costs"] == 19
    extra = p.add(R2(np.zeros((3, 2))), "extra")
    with pytest.raises(tandem.BadInputError, match="x 0"):
        p.remove([extra, x])
    assert p.has(extra) and p.has([extra, x[0]])
    p.remove([extra[0], extra[1:]])
    assert not p.has(extra)


def test_noise_and_bounds_of_each_block_in_one_call():
    rng, n = np.random.default_rng(3), 19
    roots = rng.normal(size=(n, 6, 6)) + 3 * np.eye(6)
    information = roots @ roots.transpose(0, 2, 1)
    noise = tandem.Gaussian.information(information)
    assert len(noise) == n and noise.dim == 6 and noise.sigmas.shape == (n, 6)
    assert np.allclose(noise.matrix @ information, np.eye(6), atol=1e-9)
    assert np.allclose(noise[3].matrix, noise.matrix[3]) and len(noise[2:5]) == 3 and "\n" not in repr(noise)
    assert np.allclose(pickle.loads(pickle.dumps(noise)).matrix, noise.matrix)
    steps, lower = SE3.exp(rng.normal(size=(n, 6))), rng.normal(size=(n, 1)) - 9
    costs = []
    for way in ("arrays", "covariance", "list", "loop"):
        p = tandem.Problem()
        x = p.add(SE3.identity(n + 1), "x")
        motion = tandem.TwistComponents(1.0, "sway heave")
        if way == "loop":
            for i in range(n):
                p.minimize(tandem.RelativePose(steps[i]), tandem.Gaussian.information(information[i]), [x[i], x[i + 1]])
            blocks = [p.subject_to(motion, tandem.between(float(lower[i, 0]), [1, 2]), [x[i], x[i + 1]]) for i in range(n)]
            bounds = [p.bounds(b) for b in blocks]
        else:
            given = {"arrays": noise, "covariance": tandem.Gaussian.covariance(noise.matrix), "list": list(noise)}[way]
            p.minimize(tandem.RelativePose(steps), given, [x[:-1], x[1:]])
            limits = tandem.between(lower, [1, 2])
            if way == "list":
                limits = [tandem.between(float(low), [1, 2]) for low in lower[:, 0]]
            blocks = p.subject_to(motion, limits, [x[:-1], x[1:]])
            assert p.bounds(blocks).lower.shape == (n, 2)
            bounds = [p.bounds(block) for block in blocks]
        assert [b.lower for b in bounds] == [[low, low] for low in lower[:, 0]] and bounds[0].upper == [1.0, 2.0]
        costs.append(p.cost())
    assert costs[0] > 0 and np.allclose(costs, costs[0], rtol=1e-9)
    soft = tandem.SoftBound(tandem.Range(0.0), tandem.at_most([[1.0], [2.0]]))
    assert np.allclose(soft(SE3(), R3([4.0, 0.0, 0.0])), [[3.0], [2.0]])


def test_blocks_are_changed_in_place():
    def problem(z, sigmas, loss, bounds):
        p = tandem.Problem()
        x = p.add(R2(np.zeros((3, 2))), "x")
        costs = p.minimize(tandem.Prior(R2(z)), sigmas, x, loss=loss)
        limits = p.subject_to(tandem.Prior(R2([0.0, 0.0])), bounds, x)
        return p, x, costs, limits

    rng = np.random.default_rng(4)
    z, sigmas = rng.normal(size=(3, 2)), rng.uniform(0.5, 2, size=(3, 2))
    bounds = tandem.between(-np.abs(z) - 1, np.abs(z) / 2)
    expected, y, _, of_expected = problem(z, sigmas, tandem.Huber(0.5), bounds)
    p, x, costs, limits = problem(np.ones((3, 2)), 1.0, None, (-5.0, 5.0))
    p.solve()
    assert p.loss(costs[0]) is None and np.array_equal(p.noise(costs).sigmas, np.ones((3, 2)))
    for change in (lambda: p.set_residual(costs, tandem.Prior(R2(z))), lambda: p.set_noise(costs, sigmas),
                   lambda: p.set_loss(costs, tandem.Huber(0.5)), lambda: p.set_bounds(limits, bounds)):
        p.solve()
        p.multipliers(limits)
        change()
        with pytest.raises(tandem.NumericalError, match="has changed since the last solve"):
            p.multipliers(limits)
    assert p.solve().cost == pytest.approx(expected.solve().cost, rel=1e-6)
    assert np.allclose(p.value(x).vector, expected.value(y).vector, atol=1e-6)
    assert np.allclose(p.multipliers(limits), expected.multipliers(of_expected), atol=1e-5)
    assert [loss.scale for loss in p.loss(costs)] == [0.5] * 3
    assert np.array_equal(p.bounds(limits).upper, bounds.upper)
    p.set_noise(costs[1], tandem.Gaussian.covariance([[2.0, 1.0], [1.0, 2.0]]))
    assert np.allclose(p.noise(costs).matrix[1], [[2, 1], [1, 2]])


def test_refused_changes_of_blocks_change_nothing():
    p, x, blocks, _ = chain()
    limits = p.subject_to(tandem.TwistComponents(1.0, "sway heave"), (-1.0, 1.0), [x[:-1], x[1:]])
    p.remove(blocks[3])
    q, before = p.copy(), p.cost()
    for call, error in (
            (lambda: p.set_noise(blocks, 1.0), tandem.StaleHandleError), (lambda: p.set_loss(blocks, tandem.Huber(1.0)),
                                                                         tandem.StaleHandleError),
            (lambda: p.set_residual(blocks, tandem.RelativePose(SE3())), tandem.StaleHandleError),
            (lambda: p.set_noise(limits, 1.0), tandem.BadInputError), (lambda: p.set_bounds(blocks[0], 1.0), tandem.BadInputError),
            (lambda: p.set_noise(blocks[0], np.ones(3)), ValueError),
            (lambda: p.set_bounds(limits, np.ones((18, 2))), ValueError),
            (lambda: p.set_residual(blocks[0], tandem.Prior(SE3())), tandem.BadInputError),
            (lambda: p.set_residual(limits[0], tandem.TwistComponents(1.0, "surge")), tandem.BadInputError),
            (lambda: p.set_residual(limits[:3], tandem.TwistComponents(np.ones(2), "sway heave")), ValueError),
            (lambda: p.set_residual(blocks[0], 3.0), TypeError),
            (lambda: p.set_residual(blocks[0], tandem.residual(lambda a, b: a.log(), dim=6)), tandem.BadInputError)):
        with pytest.raises(error) as raised:
            call()
        assert "\n" not in str(raised.value)
    assert p.cost() == before and p.bounds(limits[0]).lower == [-1.0, -1.0]
    assert q.cost() == before

    def change(state):
        with pytest.raises(tandem.BusyError):
            p.set_noise(blocks[0], 1.0)

    p.solve(progress=change)


@pytest.mark.parametrize("batched", [False, True])
@pytest.mark.parametrize("hard", [False, True])
def test_residuals_of_ones_own_are_replaced(batched, hard):
    def distance(z):
        def rows(x, data=None):
            return x - (z if data is None else data)
        return tandem.residual(rows, dim=1, name="distance", batched=batched, data=np.reshape(z, (-1, 1)) if batched else ())

    p = tandem.Problem()
    x = p.add(R1(np.zeros((4, 1))), "x")
    own = distance(np.arange(4.0)) if batched else distance(1.0)
    p.minimize(tandem.Prior(R1([0.0])), 1.0, x)
    blocks = p.subject_to(own, tandem.equal_to(0), x) if hard else p.minimize(own, 1e-6, x)
    library = p.minimize(tandem.Prior(R1([0.0])), 1.0, x)
    released = weakref.ref(own.function)
    q = p.copy()
    p.solve()
    p.set_residual(blocks, distance(np.full(4, 7.0)) if batched else distance(7.0))
    if hard:
        with pytest.raises(tandem.NumericalError, match="a residual has changed"):
            p.multipliers(blocks)
    p.set_residual(blocks[2], distance(np.array([9.0])) if batched else distance(9.0))
    for problem in (p, p.copy()):
        problem.solve()
        values = np.ravel([problem.value(v).vector for v in problem.variables])
        assert np.allclose(values, [7, 7, 9, 7], atol=1e-6)
    q.solve()
    assert np.allclose(q.value(q.counterpart(x)).vector.ravel(), np.arange(4.0) if batched else np.ones(4), atol=1e-6)
    for wrong, error in ((tandem.residual(lambda v: v, dim=1, name="other"), tandem.BadInputError),
                         (tandem.residual(lambda v: [v[0], v[0]], dim=2, name="distance"), tandem.BadInputError),
                         (tandem.Prior(R1([1.0])), tandem.BadInputError)):
        with pytest.raises(error, match="set_residual: the block is distance of x 0, not a residual"):
            p.set_residual(blocks, wrong)
    if batched:
        with pytest.raises(ValueError, match="3 rows of data for 4 blocks"):
            p.set_residual(blocks, distance(np.ones(3)))
    with pytest.raises(tandem.BadInputError, match="the block is prior of x 0"):
        p.set_residual(library, own)
    del own, q
    gc.collect()
    assert released() is None  # neither problem keeps the function that was replaced


def test_a_problem_of_a_method_of_its_owner_is_collected():
    class Smoother:
        def __init__(self):
            self.problem = tandem.Problem()
            self.x = self.problem.add(R1([8.0]), "x")
            self.block = self.problem.minimize(tandem.residual(self.rows, dim=1), 1.0, self.x)

        def rows(self, x):
            return x - 1.0

    smoother = Smoother()
    assert gc.is_tracked(smoother.problem) and smoother.problem.solve().converged
    kept, alive = smoother.problem, weakref.ref(smoother)
    del smoother
    gc.collect()
    assert alive() is not None and kept.cost() < 1e-12  # the problem needs the method
    copied = kept.copy()
    del kept
    gc.collect()
    assert copied.cost() < 1e-12
    del copied
    gc.collect()
    assert alive() is None
