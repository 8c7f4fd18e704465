"""Problems: variables, blocks, solvers, covariances and files."""

import copy
import pickle

import numpy as np
import pytest

import tandem
from tandem import R1, R2, R3, SE2, SE3

from chains import chain


def test_chain_is_solved():
    p, x, odometry, truth = chain()
    summary = p.solve()
    assert summary.converged and summary.cost < 1e-12
    assert np.allclose(p.value(x).minus(truth), 0, atol=1e-6)
    assert len(odometry) == 19 and "<" in repr(odometry)


def test_single_calls_equal_one_call_with_arrays():
    p, x, _, truth = chain()
    q = tandem.Problem()
    y = [q.add(v, f"x {i}") for i, v in enumerate(p.value(x))]
    q.minimize(tandem.Prior(truth[0]), 1e-3, y[0])
    for i in range(19):
        step = tandem.RelativePose(truth[i].inverse() @ truth[i + 1])
        q.minimize(step, [0.1, 0.1, 0.1, 0.01, 0.01, 0.01], [y[i], y[i + 1]])
    assert p.solve().cost == pytest.approx(q.solve().cost, abs=1e-12)
    assert np.allclose(p.value(x)[7].minus(q.value(y[7])), 0, atol=1e-9)


def test_hard_constraint_and_multiplier():
    p = tandem.Problem()
    x = p.add(R2([0.0, 0.0]), "x")
    p.minimize(tandem.Prior(R2([2.0, 1.0])), 1.0, x)
    bound = p.subject_to(tandem.Prior(R2([0.0, 0.0])), ([-np.inf, -np.inf], [1.5, np.inf]), x)
    for solver in ("auto", "augmented-lagrangian", "damped-sqp", "ipopt"):
        q = p.copy()
        y = q.counterpart(x)
        summary = q.solve(solver, **({"cost_tolerance": 1e-14} if solver == "damped-sqp" else {}))
        if summary.status == "unsupported":
            continue
        assert summary.converged
        assert np.allclose(q.value(y).vector, [1.5, 1.0], atol=1e-6)
        assert np.allclose(q.multipliers(bound), [0.5, 0], atol=1e-6)


def test_non_holonomic_motion():
    p, x, _, _ = chain()
    p.subject_to(tandem.TwistComponents(1.0, "sway heave"), tandem.equal_to(0), [x[:-1], x[1:]])
    assert p.solve().converged
    twist = p.value(x)[1:].minus(p.value(x)[:-1])
    assert np.abs(twist[:, 1:3]).max() < 1e-8


def test_infeasible_problems_name_the_constraint():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    p.minimize(tandem.Prior(R1([0.0])), 1.0, x)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_least(1.0), x)
    p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(-1.0), x)
    summary = p.solve()
    assert not summary.converged
    with pytest.raises(tandem.NumericalError) as error:
        summary.require_converged()
    if summary.status == "infeasible":
        assert isinstance(error.value, tandem.InfeasibleError) and "x" in error.value.constraints[0]


def test_robust_losses():
    p = tandem.Problem()
    x = p.add(R1([0.0]), "x")
    for z in (0.0, 0.1, -0.1, 100.0):
        last = p.minimize(tandem.Prior(R1([z])), 1.0, x, loss=tandem.GemanMcClure(1.0))
    p.solve(graduated=True)
    assert abs(p.value(x).vector[0]) < 0.1 and p.weight(last) < 1e-3


def test_marginals():
    p, x, _, _ = chain()
    p.solve()
    marginals = tandem.Marginals(p)
    S = marginals.covariance(x)
    assert S.shape == (20, 6, 6) and np.all(np.diff(np.trace(S, axis1=1, axis2=2)) > 0)
    joint = marginals.joint([x[3], x[4]])
    assert joint.shape == (12, 12) and np.allclose(joint[:6, :6], S[3])


def test_unobservable_directions_have_readable_names():
    p = tandem.Problem()
    x = p.add(SE2(0.0, [0.0, 0.0]), "ship")
    y = p.add(R2([1.0, 0.0]), "buoy")
    p.minimize(tandem.Range(1.0), 0.1, [x, y])
    p.minimize(tandem.Prior(R2([1.0, 0.0])), 0.1, y)
    p.solve()
    with pytest.raises(tandem.NotObservableError) as error:
        tandem.Marginals(p).require_regular()
    assert error.value.state == "ship" and error.value.direction


def test_copies_are_independent():
    p, x, _, _ = chain()
    for q in (p.copy(), copy.copy(p), copy.deepcopy(p)):
        q.solve()
        assert not np.allclose(q.value(q.counterpart(x)).minus(p.value(x)), 0)
        with pytest.raises(tandem.StaleHandleError, match="x 0"):
            q.value(x)


def test_pickled_and_written_problems_are_complete(tmp_path):
    p, x, _, _ = chain()
    p.subject_to(tandem.TwistComponents(1.0, "sway heave"), tandem.equal_to(0), [x[:-1], x[1:]])
    p.write(tmp_path / "problem.json")
    for q in (pickle.loads(pickle.dumps(p)), tandem.Problem.read(tmp_path / "problem.json")):
        assert q.statistics == p.statistics and q.statistics["costs"] == 20
        assert q.solve().cost == p.copy().solve().cost


POSE, OTHER = SE3.exp([0.1, 0.2, -0.1, 0.1, -0.2, 0.3]), SE3.exp([4.0, 1.0, 0.5, -0.1, 0.2, 0.4])
POINT, ZERO = R3([4.0, 1.0, 0.5]), R1([0.1])
SAMPLES = np.array([[0.1 * k, 0.1, 0.2, 9.8, 0.01, -0.02, 0.03] for k in range(11)])
NOISE = dict(accelerometer=1e-2, gyroscope=1e-3, accelerometer_bias_walk=1e-4, gyroscope_bias_walk=1e-5)
IMU = tandem.preintegrate_imu(SAMPLES, **NOISE)[0]


@pytest.mark.parametrize("residual, states", [
    (tandem.Interpolated(tandem.Range(3.0), 0.3), [POSE, POSE.plus(np.full(6, 0.1)), OTHER, OTHER.plus(np.full(6, 0.1))]),
    (tandem.Interpolated(tandem.UsblPosition([1, 2, 3]), 0.3), [POSE, POSE, POINT, R3([5.0, 1.0, 0.0])]),
    (tandem.SteadyCourse(tandem.Bearing([1, 0.1, 0.2]), 2.0), [POSE, OTHER, ZERO]),
    (tandem.WithBias(tandem.RangeBearing(3.0, [1, 0, 0])), [POSE, OTHER, R3([0.1, 0.2, 0.3])]),
    (tandem.WithBias(tandem.Depth(1.0)), [POSE, ZERO]),
    (tandem.Miscalibrated(tandem.UsblSpherical(3.0, 0.2, 0.1), before=1.0, after=1.0),
     [POSE, POSE.plus(np.full(6, -0.1)), POSE.plus(np.full(6, 0.1)), POINT, R3([3.9, 1.0, 0.5]), R3([4.1, 1.0, 0.5]),
      R3([0.1, 0.0, 0.1]), ZERO, tandem.SO3.exp([0.1, 0.0, 0.1]), R1([0.05])]),
    (tandem.LogRange(2.0), [POSE, OTHER]),
    (tandem.Range(2.0), [POINT, R3([1.0, 2.0, 3.0])]),
    (tandem.Range(2.0), [R2([4.0, 1.0]), R2([1.0, 2.0])]),
    (tandem.EulerKinematics(0.1), [tandem.SO3.exp([0.1, 0.2, 0.3]), POINT, tandem.SO3.exp([0.3, 0.2, 0.1])]),
    (tandem.EulerKinematics(0.1), [POSE, tandem.R6([1, 0, 0.2, 0.1, 0, 0.1]), OTHER]),
    (tandem.QuadrotorRate(0.5, [0.01, 0.02, 0.03], 0.2, 0.01, 9.81, 0.1),
     [R3([0.1, 0.2, 0.3]), tandem.R4([1.0, 1.1, 1.2, 1.3]), R3([0.3, 0.2, 0.1])]),
    (tandem.QuadrotorVelocity(0.5, [0.01, 0.02, 0.03], 0.2, 0.01, 9.81, 0.1),
     [R3([0.1, 0.2, 0.3]), tandem.SO3.exp([0.1, 0.2, 0.3]), tandem.R4([1.0, 1.1, 1.2, 1.3]), R3([0.3, 0.2, 0.1])]),
    *[(tandem.TwistComponents(0.5, axes), [POSE, OTHER]) for axes in
      ("surge", "sway", "heave", "roll_rate", "pitch_rate", "yaw_rate", "pitch_rate yaw_rate")],
    (tandem.Propagated(tandem.Depth(1.0), IMU), [POSE, R3([1.0, 0.0, 0.0]), tandem.R6(np.full(6, 0.01))]),
    (tandem.Propagated(tandem.DvlVelocity([1.0, 0.1, 0.0]), IMU),
     [POSE, R3([1.0, 0.0, 0.0]), tandem.R6(np.full(6, 0.01))]),
    (tandem.MiscalibratedEgo(tandem.DvlVelocity([1.0, 0.1, 0.0]), mount=tandem.SO3.exp([0.1, 0.2, 0.3]), imu=IMU,
                             rate=[0.1, 0.0, 0.2], force=[0.1, 0.2, 9.8]),
     [POSE, R3([1.0, 0.0, 0.0]), tandem.R6(np.full(6, 0.01)), R3([0.1, 0.2, 0.3]), ZERO, tandem.SO3.exp([0.1, 0.0, 0.1]),
      R1([0.05])]),
    (tandem.MiscalibratedEgo(tandem.Heading(tandem.SO3.exp([0.1, 0.0, 0.1]))),
     [POSE, R3([1.0, 0.0, 0.0]), tandem.R6(np.full(6, 0.01)), R3([0.1, 0.2, 0.3]), ZERO, tandem.SO3.exp([0.1, 0.0, 0.1]),
      R1([0.05])]),
    (tandem.SoftBound(tandem.Range(0.0), tandem.at_most(2.0)), [POSE, OTHER]),
    (tandem.SoftBound(tandem.TwistComponents(1.0, "surge"), (-np.inf, 1.0)), [POSE, OTHER]),
    (tandem.TwistKinematics(0.5), [POSE, tandem.R6([1, 0, 0, 0, 0, 0.1]), OTHER, tandem.R6([1.1, 0, 0, 0, 0, 0.1])]),
    (tandem.ActuatorLag([0.5, 0.9, 0.0]), [R3([1.0, 2.0, 3.0])] * 3),
    (tandem.Vehicle("bluerov2_heavy").actuator_lag(0.2), [tandem.R8(np.linspace(-1.0, 1.0, 8))] * 3),
    (tandem.Vehicle("remus_100").dynamics(0.5), [
        POSE, tandem.R6([1.5, 0.1, 0, 0, 0.1, 0.2]), tandem.R6([1.4, 0.1, 0.1, 0, 0.1, 0.1]), R3([0.8, 0.1, -0.1]),
        R3([0.5, 0.1, 0.1]), R3([0.2, -0.1, 0.0])]),
    (tandem.Vehicle("bluerov2_heavy").dynamics(0.2), [
        POSE, tandem.R6([0.5, 0.1, 0, 0, 0.1, 0.2]), tandem.R6([0.4, 0.1, 0.1, 0, 0.1, 0.1]),
        tandem.R8(np.linspace(-1.0, 1.0, 8)), tandem.R8(np.linspace(1.0, -1.0, 8)), R3([0.2, -0.1, 0.0])]),
    (tandem.InsideCone(0.5), [POSE, POINT]),
    (tandem.Visibility(range=5.0), [POSE, OTHER, ZERO]),
    (IMU,
     [POSE, R3([1.0, 0.0, 0.0]), tandem.R6(np.full(6, 0.01)), OTHER, R3([1.1, 0.1, -0.1]), tandem.R6(np.full(6, 0.02))]),
    (tandem.Prior(tandem.Bundle(POSE, POINT)), [tandem.Bundle(OTHER, R3([1.0, 2.0, 3.0]))]),
    (tandem.RelativePose(tandem.Bundle(POSE, OTHER)), [tandem.Bundle(OTHER, POSE), tandem.Bundle(POSE, POSE)]),
], ids=lambda x: x.name if isinstance(x, tandem.Residual) else "")
def test_jacobians_of_residuals_with_parts_and_files(residual, states, tmp_path):
    rows, jacobians = residual(*states, jacobians=True)
    for s, J in enumerate(jacobians):
        for k in range(J.shape[1]):
            step = 1e-6 * np.eye(J.shape[1])[k]
            ends = [residual(*states[:s], states[s].plus(sign * step), *states[s + 1:]) for sign in (1, -1)]
            assert np.allclose(J[:, k], (ends[0] - ends[1]) / 2e-6, atol=1e-5), (s, k)
    p = tandem.Problem()
    x = [p.add(state, f"x{i}") for i, state in enumerate(states)]
    p.minimize(residual, 1.0, x)
    p.subject_to(residual, (rows - 1, rows + 1), x)
    p.write(tmp_path / "problem.json")
    q = tandem.Problem.read(tmp_path / "problem.json")
    assert np.allclose(q.linearization(q.blocks[0])[0], rows, atol=1e-12)
    assert repr(pickle.loads(pickle.dumps(residual))) == repr(residual)


def test_problem_of_the_command_line_is_read(tmp_path):
    tandem.estimate("docking_a", max_keyframes=60, write_problem=tmp_path / "problem.json")
    p = tandem.Problem.read(tmp_path / "problem.json")
    assert p.solve().converged


def test_fixed_lag():
    lag = tandem.FixedLag(window=3.0)
    previous = None
    for k in range(10):
        x = lag.add(float(k), R1([0.0]), f"x{k}")
        lag.problem.minimize(tandem.Prior(R1([float(k)])), 1.0, x)
        if previous is not None:
            lag.problem.minimize(tandem.RelativePose(R1([1.0])), 0.1, [previous, x])
        assert lag.update().converged
        previous = x
    assert lag.problem.value(previous).vector[0] == pytest.approx(9.0)
    assert lag.oldest >= 5.0 and lag.covariance(previous)[0, 0] < 1.0
    with pytest.raises(tandem.BadInputError, match="before the window"):
        lag.add(0.0, R1([0.0]))
    with pytest.raises(tandem.BadInputError, match="time of a variable is not finite"):
        lag.add(np.nan, R1([0.0]))


def constrained_states(lag, n):
    """Noisy drift along a path that must not exceed 3 and passes 1.5 at state 3. With lag, the smoother; else a batch."""
    p = lag.problem if lag else tandem.Problem()
    states = []
    for k in range(n):
        x = lag.add(float(k), R1([0.0]), f"x{k}") if lag else p.add(R1([0.0]), f"x{k}")
        p.minimize(tandem.Prior(R1([k + 0.3 * np.sin(k)])), 1.0, x)
        if states:
            p.minimize(tandem.RelativePose(R1([0.5])), 0.5, [states[-1], x])
        p.subject_to(tandem.Prior(R1([0.0])), tandem.equal_to(1.5) if k == 3 else tandem.at_most(3.0), x)
        states.append(x)
        if lag:
            assert lag.update().converged
    if not lag:
        assert p.solve().converged
    return p, states


def test_fixed_lag_with_hard_constraints_equals_the_batch():
    lag = tandem.FixedLag(window=4.0, cost_tolerance=1e-14, max_iterations=50)
    window, of_window = constrained_states(lag, 12)
    batch, of_batch = constrained_states(None, 12)
    assert not window.has(of_window[3]) and window.has(of_window[8])
    for k in range(8, 12):
        assert np.allclose(window.value(of_window[k]).vector, batch.value(of_batch[k]).vector, atol=1e-7)
        assert window.value(of_window[k]).vector[0] <= 3.0 + 1e-8
    marginals = tandem.Marginals(batch)
    assert np.allclose(lag.joint(of_window[8:]), active_covariance(batch, of_batch, range(8, 12)), atol=1e-7)
    assert lag.covariance(of_window[11])[0, 0] == 0  # at its bound
    assert marginals.covariance(of_batch[3])[0, 0] == pytest.approx(0, abs=1e-12)


def active_covariance(p, x, of):
    """Covariance of states of a batch whose active inequalities are replaced by equalities."""
    q = p.copy()
    for v in x:
        y = q.counterpart(v)
        if abs(q.value(y).vector[0] - 3.0) < 1e-6:
            q.subject_to(tandem.Prior(R1([0.0])), tandem.equal_to(3.0), y)
    return tandem.Marginals(q).joint([q.counterpart(x[k]) for k in of])


def test_fixed_lag_adds_arrays_and_names_infeasible_constraints():
    lag = tandem.FixedLag(window=5.0)
    x = lag.add(0.0, R1([[0.0], [1.0]]), "x")
    lag.problem.minimize(tandem.Prior(R1([[0.0], [1.0]])), 1.0, x)
    assert lag.update().converged and lag.covariance(x).shape == (2, 1, 1)
    variables = lag.problem.statistics["variables"]
    for t in (np.nan, np.inf):
        with pytest.raises(tandem.BadInputError, match="not finite"):
            lag.add(t, R1([0.0]))
    assert lag.problem.statistics["variables"] == variables
    lag.problem.subject_to(tandem.Prior(R1([0.0])), tandem.at_least(2.0), x[0])
    lag.problem.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(1.0), x[0])
    summary = lag.update()
    assert summary.status == "infeasible" and "x 0" in summary.worst_constraint
    with pytest.raises(tandem.InfeasibleError):
        summary.require_converged()


def test_arrays_are_indexed_as_in_numpy():
    p, x, *_ = chain()
    for selection in ([1, -1], np.array([3, 0], dtype=np.int32), np.arange(20) % 2 == 0, [], slice(2, 9, 3)):
        assert [v.name for v in x[selection]] == [f"x {i}" for i in np.arange(20)[selection]]
        assert np.allclose(p.value(x)[selection].minus(p.value(x[selection])), 0)


def test_lists_of_variables_are_arrays():
    p = tandem.Problem()
    xs = [p.add(SE3.exp([float(i), 0, 0, 0, 0, 0]), f"x{i}") for i in range(5)]
    blocks = p.minimize(tandem.RelativePose(SE3.identity(4)), 1.0, [xs[:-1], xs[1:]])
    assert len(blocks) == 4 and p.cost() == pytest.approx(2.0)
    assert np.allclose(p.value(xs).translation[:, 0], range(5)) and p.value(xs[0]).translation.shape == (3,)
    assert p["x3"] == xs[3]
    with pytest.raises(KeyError, match="x9"):
        p["x9"]
    p.minimize(tandem.Prior(SE3()), 1.0, xs[0])
    p.solve()
    assert p.cost() < 1e-12 and tandem.Marginals(p).covariance(xs).shape == (5, 6, 6)
    p.set_value(xs, SE3.identity(5))
    p.fix([xs[:2], xs[2:]])
    with pytest.raises(TypeError, match="SE3 and R1"):
        p.value([xs[0], p.add(R1([0.0]))])


def test_many_residuals_by_one_call():
    n = 100000
    p = tandem.Problem()
    x = p.add(R3(np.zeros((n, 3))), "x")
    blocks = p.minimize(tandem.Prior(R3(np.ones((n, 3)))), 1.0, x)
    assert len(blocks) == n and p.statistics["costs"] == n


def test_representations():
    p, x, blocks, _ = chain()
    for thing in (p, x, x[0], blocks, tandem.Gaussian([1, 2]), tandem.Huber(1.0), tandem.between(0, 1),
                  tandem.Prior(SE3()), p.solve(), tandem.Marginals(p)):
        assert "\n" not in repr(thing)
    assert "<table" in p._repr_html_() and "<svg" in p._repr_html_()


def test_small_things_can_be_pickled():
    for thing in (tandem.Gaussian([1.0, 2.0]), tandem.Huber(1.0), tandem.between(0, 1), tandem.Prior(SE3()),
                  tandem.Gaussian.covariance([[2.0, 1.0], [1.0, 2.0]])):
        assert repr(pickle.loads(pickle.dumps(thing))) == repr(thing)
        assert repr(copy.deepcopy(thing)) == repr(thing)


def same(a, b):
    """Whether all properties are equal."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    names = [k for k in dir(type(a)) if isinstance(getattr(type(a), k), property)]
    if hasattr(a, "jr"):
        return np.array_equal(a.parameters, b.parameters)
    return all(same(getattr(a, k), getattr(b, k)) for k in names) if names else a == b


def test_results_and_inputs_of_plans_and_calibrations_are_pickled():
    remus = tandem.Vehicle("remus_100")
    state = tandem.VehicleState(SE3.exp([1, 2, 3, 0.1, 0.2, 0.3]), [1.5, 0, 0, 0, 0, 0.1], [900.0, 0.1, 0.0])
    sigmas = np.full(6, 0.01)
    target = tandem.predict_target(SE3.exp([20, 0, 0, 0, 0, 0]), SE3.exp([21, 0, 0, 0, 0, 0]), 1.0, noise=sigmas, step=1.0,
                                   steps=5)
    points = tandem.TargetPrediction(target.poses, target.twists)
    plan = tandem.Planner(remus, steps=5, dt=1.0).replan(tandem.VehicleState(SE3(), [1.5, 0, 0, 0, 0, 0]), target)
    cone = tandem.Cone(0.5, SE3.exp([1, 0, 0, 0, 0, 0]), [1.0, 2.0, 3.0])
    p = tandem.Problem()
    blocks = p.minimize(tandem.Prior(R1(np.random.default_rng(1).normal(size=(50, 1)))), 1.0, p.add(R1([0.0])))
    calibration = tandem.Calibration(p, {"scale": blocks})
    for thing in (state, target, points, plan, cone, calibration, calibration.noise["scale"], remus):
        for again in (copy.copy(thing), copy.deepcopy(thing), pickle.loads(pickle.dumps(thing))):
            assert type(again) is type(thing) and repr(again) == repr(thing) and same(again, thing)
    command = remus.upper * [1, 0, 0]
    stepped = [v.step(s, command, 0.5) for v, s in ((remus, state), pickle.loads(pickle.dumps((remus, state))))]
    assert same(*stepped)
    planner = tandem.Planner(copy.deepcopy(remus), steps=5, dt=1.0)
    assert planner.vehicle.name == remus.name


def test_a_vehicle_from_a_file_is_pickled_with_its_content(tmp_path):
    import tandem.scenario
    file = tmp_path / "mine.yaml"
    file.write_bytes((tandem.scenario.share("vehicles") / "remus_100.yaml").read_bytes())
    pickled = pickle.dumps(tandem.Vehicle(file))
    file.unlink()
    assert pickle.loads(pickled).actuators == tandem.Vehicle("remus_100").actuators


def test_handles_are_copied_but_not_pickled():
    p, x, blocks, _ = chain()
    for handle in (x, x[0], blocks):
        assert copy.copy(handle) is handle and copy.deepcopy({"a": handle})["a"] is handle
        with pytest.raises(TypeError, match=f"{type(handle).__name__} cannot be pickled, .* pickle the Problem"):
            pickle.dumps(handle)
    for thing in (tandem.Marginals(p), tandem.FixedLag(), tandem.Planner(tandem.Vehicle("remus_100"), steps=2, dt=1.0),
                  tandem.OnlineEstimator("docking_a")):
        for refused in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match=f"cannot pickle .*{type(thing).__name__}"):
                refused(thing)
