"""Calibration, OnlineEstimator and Planner."""

import threading

import numpy as np
import pytest

import tandem
from tandem import R1, SE3


def walk(step_sigma=0.3, fix_sigma=0.5, n=400, seed=3):
    """A random walk with fixes; given noise 1 for both: problem, steps, fixes."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.normal(scale=step_sigma, size=n))
    p = tandem.Problem()
    x = p.add(R1(np.zeros((n, 1))), "x")
    steps = p.minimize(tandem.RelativePose(R1([0.0])), 1.0, [x[:-1], x[1:]])
    fixes = p.minimize(tandem.Prior(R1((truth + rng.normal(scale=fix_sigma, size=n))[:, None])), 1.0, x)
    return p, steps, fixes


def test_calibration_finds_the_noise():
    p, steps, fixes = walk()
    seen = []
    c = tandem.Calibration(p, {"steps": steps, "fixes": fixes}, profile_points=5, progress=seen.append)
    assert c.converged and c.gain > 10 and c.iterations > 0
    for name, truth in (("steps", 0.3), ("fixes", 0.5)):
        noise = c.noise[name]
        assert abs(np.log(noise.factor / truth)) < 3 * noise.log_error and noise.identifiable
        assert noise.flat[0] < noise.factor < noise.flat[1] and noise.profile.shape == (5, 2)
        assert c.factors[name] == noise.factor
    assert c.log_covariance.shape == (2, 2) and c.noise["fixes"].rows == 400
    assert set(seen[-1]["factors"]) == {"steps", "fixes"}
    assert "\n" not in repr(c) and "factor" in repr(c.noise["steps"])


def test_calibration_leaves_the_problem_solved():
    p, steps, fixes = walk(n=50)
    bound = p.subject_to(tandem.Prior(R1([0.0])), tandem.at_most(-2.0), p["x 20"])
    tandem.Calibration(p, {"steps": steps, "fixes": fixes})
    calibrated = p.multipliers(bound)
    p.solve()
    assert np.allclose(p.multipliers(bound), calibrated, rtol=1e-5) and np.any(calibrated != 0)


def test_calibration_of_several_problems_and_of_rows():
    p, *of_p = walk(seed=1)
    q, *of_q = walk(seed=2)
    groups = [dict(zip(("steps", "fixes"), blocks)) for blocks in (of_p, of_q)]
    both = tandem.Calibration([p, q], groups, ranges=False)
    assert both.converged and both.factors["fixes"] == pytest.approx(0.5, rel=0.15)
    r = tandem.Problem()
    x = r.add(tandem.R2([0.0, 0.0]), "x")
    z = np.random.default_rng(5).normal(size=(300, 2)) * [0.2, 3.0]
    blocks = r.minimize(tandem.Prior(tandem.R2(z)), 1.0, x)
    c = tandem.Calibration(r, {"along": (blocks, 0), "across": (blocks, slice(1, None))}, priors={"along": 0.0})
    assert c.factors["along"] == pytest.approx(0.2, rel=0.15) and c.factors["across"] == pytest.approx(3.0, rel=0.15)


@pytest.mark.parametrize("call, error, message", [
    (lambda p, s, f: tandem.Calibration(p, {}), ValueError, "group"),
    (lambda p, s, f: tandem.Calibration(p, {"a": s, "b": s}), ValueError, "two noise groups, a and b"),
    (lambda p, s, f: tandem.Calibration(p, {"a": None}), TypeError, "group a: expected blocks"),
    (lambda p, s, f: tandem.Calibration(p, {"a": (s, "x")}), TypeError, "rows are an index"),
    (lambda p, s, f: tandem.Calibration(p, {"a": (s, 7)}), ValueError, "row"),
    (lambda p, s, f: tandem.Calibration(p, [s]), TypeError, "dictionary"),
    (lambda p, s, f: tandem.Calibration(p, {"a": s}, priors={"b": 1.0}), ValueError, "group b"),
    (lambda p, s, f: tandem.Calibration(p, {"a": s}, maximum=1), TypeError, "the options are"),
    (lambda p, s, f: tandem.Calibration(None, {"a": s}), TypeError, ""),
    (lambda p, s, f: tandem.Calibration(tandem.Problem(), {"a": s}), tandem.StaleHandleError, ""),
])
def test_bad_calibrations_are_one_sentence(call, error, message):
    p, steps, fixes = walk(n=20)
    with pytest.raises(error, match=message) as raised:
        call(p, steps, fixes)
    assert message == "" or "\n" not in str(raised.value)
    assert p.solve().converged  # not marked as being solved


def test_interrupted_calibration_returns_the_best_factors():
    p, steps, fixes = walk()

    def progress(_):
        raise KeyboardInterrupt

    c = tandem.Calibration(p, {"steps": steps, "fixes": fixes}, progress=progress)
    assert c.status == "interrupted" and np.isfinite(list(c.factors.values())).all()


def test_exceptions_of_the_progress_of_a_calibration_are_chained():
    p, steps, fixes = walk(n=20)

    def progress(_):
        raise KeyError("mine")

    with pytest.raises(tandem.ResidualError) as error:
        tandem.Calibration(p, {"steps": steps}, progress=progress)
    assert isinstance(error.value.__cause__, KeyError)


def fed(estimator, scenario, n=12):
    """Feeds odometry and the first n fixes in order of time; returns the reasons of rejections."""
    rows = [("odometry", [t, *p, *q]) for t, p, q in
            zip(scenario.odometry.t, scenario.odometry.positions, scenario.odometry.quaternions)]
    rows += [("usbl", row) for row in scenario.measurements["usbl"][:n]]
    last = scenario.measurements["usbl"][n - 1][0]
    rows = sorted((r for r in rows if r[1][0] <= last + 1), key=lambda r: r[1][0])
    reasons = [estimator.add(sensor, row) for sensor, row in rows]
    estimator.finish()
    return [r for r in reasons if r]


def test_online_estimator_follows_the_target():
    s = tandem.read_scenario("docking_a")
    e = tandem.OnlineEstimator(s, window=60, non_holonomic="soft", noise={"usbl": (2, 2, 3)})
    assert not e.started and "no estimate" in repr(e)
    with pytest.raises(tandem.BadInputError, match="no estimate yet"):
        e.chaser
    assert "before" in (e.add("usbl", s.measurements["usbl"][0]) or "before")
    fed(e, s)
    assert e.started and e.has_target and e.oldest < e.newest and "keyframes" in repr(e)
    truth = s.truth_target.at([e.newest])
    position = e.target.translation if isinstance(e.target, SE3) else e.target
    assert np.linalg.norm(position - truth.positions[0]) < 10
    relative, covariance = e.relative_target(5.0)
    assert relative.shape == (3,) and np.all(np.linalg.eigvalsh(covariance) > 0)
    assert e.covariance()["chaser"].shape == (6, 6) and e.predicted_chaser(1.0).translation.shape == (3,)
    t, poses = e.window()
    assert len(t) == len(poses) == e.keyframes and t[-1] == e.newest
    updates = e.updates()
    assert updates[-1]["summary"].cost >= 0 and not e.updates()
    assert e.health["sensors"]["usbl"]["used"] > 5 and e.health["target"]["state"] == "aided"
    assert e.solve_to_convergence().converged
    e.reset()
    assert not e.started


@pytest.mark.parametrize("call, error, message", [
    (lambda e: e.add("sonar", [0, 1, 2, 3]), ValueError, "no sensor sonar; there are odometry, usbl, optical"),
    (lambda e: e.add("usbl", [0, 1, 2]), ValueError, "t,x,y,z.*shape"),
    (lambda e: e.add("usbl", [0, 1, 2, np.nan]), ValueError, "NaN"),
    (lambda e: e.add("usbl", None), ValueError, "numbers"),
    (lambda e: e.add("odometry", [0, 1, 2, 3, 0, 0, 0, 5]), ValueError, "quaternion"),
    (lambda e: e.predicted_target(1.0), ValueError, "no estimate yet"),
    (lambda e: tandem.OnlineEstimator("docking_a", windows=3), TypeError, "windows; the options are window"),
    (lambda e: tandem.OnlineEstimator("docking_a", window=-1), ValueError, "window"),
    (lambda e: tandem.OnlineEstimator("docking_a", window="long"), TypeError, "window"),
    (lambda e: tandem.OnlineEstimator("docking_a", mode="C"), ValueError, "mode"),
    (lambda e: tandem.OnlineEstimator("docking_a", newest="best"), ValueError, "hypotheses, window"),
    (lambda e: tandem.OnlineEstimator("no_such_scenario"), ValueError, "no_such_scenario"),
    (lambda e: tandem.OnlineEstimator(None), ValueError, "Scenario"),
])
def test_bad_input_of_online_estimators_is_one_sentence(call, error, message):
    e = tandem.OnlineEstimator("docking_a")
    with pytest.raises(error, match=message) as raised:
        call(e)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name, Actuators", [("remus_100", tandem.R3), ("bluerov2_heavy", tandem.R8)])
def test_residuals_of_a_vehicle_agree_with_its_step(name, Actuators):
    vehicle, dt = tandem.Vehicle(name), 0.2
    start = tandem.VehicleState(SE3(), [1.0, 0.1, 0.0, 0.0, 0.02, 0.1], 0.2 * vehicle.upper)
    command, current = 0.5 * vehicle.upper, [0.1, -0.2, 0.0]
    end = vehicle.step(start, command, dt, current)
    twists = tandem.R6(start.twist), tandem.R6(end.twist)
    actuators = [Actuators(a) for a in (start.actuators, command, end.actuators)]
    assert np.abs(vehicle.dynamics(dt)(start.pose, *twists, *actuators[:2], tandem.R3(current))).max() < 1e-9
    assert np.abs(vehicle.actuator_lag(dt)(*actuators)).max() < 1e-12
    assert np.abs(tandem.TwistKinematics(dt)(start.pose, twists[0], end.pose, twists[1])).max() < 1e-9


def remus_plan(**options):
    planner = tandem.Planner(tandem.Vehicle("remus_100"), steps=10, dt=1.0,
                             goal=SE3.exp([-6, 0, 0, 0, 0, 0]), **options)
    before, now = SE3.exp([29, 0, 0, 0, 0, 0]), SE3.exp([30, 0, 0, 0, 0, 0])
    target = tandem.predict_target(before, now, 1.0, noise=np.full(6, 0.01), step=1.0, steps=10)
    return planner, tandem.VehicleState(SE3(), [1.5, 0, 0, 0, 0, 0]), target


def test_plans_obey_dynamics_and_limits():
    planner, start, target = remus_plan(keep_out=5.0)
    assert not planner.has_plan
    plan = planner.replan(start, target)
    assert plan.accepted and plan.origin == "solved" and plan.summary.converged and planner.has_plan
    remus = planner.vehicle
    assert np.all(plan.commands >= remus.lower - 1e-6) and np.all(plan.commands <= remus.upper + 1e-6)
    for k, command in enumerate(plan.commands):
        state = remus.step(tandem.VehicleState(plan.poses[k], plan.twists[k], plan.actuators[k]), command, 1.0)
        assert np.allclose(state.pose.minus(plan.poses[k + 1]), 0, atol=2e-6)  # tolerance of plans
        assert np.allclose(state.twist, plan.twists[k + 1], atol=2e-6)
        assert np.allclose(state.actuators, plan.actuators[k + 1], atol=2e-6)
    distances = np.linalg.norm(plan.poses.translation - target.poses.translation, axis=1)
    assert distances.min() >= 5.0 - 1e-6 and distances[-1] < distances[0]
    for active in planner.active_constraints():
        assert active["constraint"] and np.isfinite(active["multiplier"])
    assert planner.replan(start, target).accepted
    planner.reset()
    assert not planner.has_plan
    assert "\n" not in repr(planner) + repr(plan) + repr(start) + repr(remus) + repr(target)


def test_predictions_from_arrays_equal_those_of_the_motion_model():
    _, _, target = remus_plan()
    again = tandem.TargetPrediction(target.poses, target.twists, target.covariances)
    assert len(again) == 11 and np.allclose(again.covariances, target.covariances)
    assert np.allclose(again.poses.minus(target.poses), 0)


@pytest.mark.parametrize("call, error, message", [
    (lambda: tandem.Vehicle("titanic"), ValueError, "no vehicle 'titanic'; there are bluerov2_heavy, remus_100"),
    (lambda: tandem.Planner("remus_100"), TypeError, ""),
    (lambda: remus_plan(step=3), TypeError, "unknown option step; the options are"),
    (lambda: remus_plan(keep_out=-1.0), ValueError, "keep"),
    (lambda: remus_plan(approach=0.3), TypeError, "approach has the wrong type"),
    (lambda: remus_plan(twist=([-1] * 5, [1] * 5)), ValueError, "6 rows"),
    (lambda: remus_plan(solver="simplex"), ValueError, "ipopt"),
    (lambda: tandem.VehicleState(np.eye(4)), TypeError, "SE3"),
    (lambda: tandem.VehicleState(SE3(), [1, 2]), ValueError, r"\(6,\)"),
    (lambda: (lambda p, s, t: p.replan(s, tandem.TargetPrediction(t.poses[:5], t.twists[:5])))(*remus_plan()), ValueError,
     "steps . 1 = 11 poses, not 5"),
    (lambda: (lambda p, s, t: p.replan(tandem.VehicleState(SE3(), None, [0.0]), t))(*remus_plan()), ValueError,
     "3 actuators, not 1"),
    (lambda: (lambda p, s, t: p.replan(s, t, [np.nan, 0, 0]))(*remus_plan()), ValueError, "NaN"),
    (lambda: tandem.TargetPrediction(SE3.identity(3), np.zeros((2, 6))), ValueError, "n poses"),
    (lambda: tandem.Vehicle("remus_100").step(tandem.VehicleState(SE3()), [0, 0, 0], 0.0), ValueError, "positive"),
])
def test_bad_input_of_planners_is_one_sentence(call, error, message):
    with pytest.raises(error, match=message) as raised:
        call()
    assert message == "" or "\n" not in str(raised.value)


def test_a_planner_in_two_threads_is_an_error():
    planner, start, target = remus_plan()
    results = []

    def plan():
        try:
            results.append(planner.replan(start, target).accepted)
        except tandem.BusyError as error:
            results.append(error)

    threads = [threading.Thread(target=plan) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4 and any(r is True for r in results)
    assert planner.replan(start, target).accepted
