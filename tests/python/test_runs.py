"""Whole runs: the same numbers as the command line, results, and bad input."""

import json
import os
import pathlib
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import tandem
from tandem._process import program


def command_line(command, *words):
    output = subprocess.run([program(command), *map(str, words), "--json"], capture_output=True, check=True)
    return json.loads(output.stdout)


def without_times(summary):
    return {k: v for k, v in summary.items() if not k.endswith("seconds")}


def test_estimate_equals_the_command_line(docking):
    assert without_times(docking.summary.to_dict()) == without_times(command_line("estimate", "docking_a"))
    assert docking.converged and docking.summary.status == "converged"


def test_options_have_the_names_and_values_of_the_command_line(tmp_path):
    result = tandem.estimate("docking_a", mode="B", non_holonomic="soft", noise={"usbl": (2, 2, 3)},
                             loss="huber:2", max_keyframes=200, threads=1)
    expected = command_line("estimate", "docking_a", "--mode", "B", "--non-holonomic", "soft", "--noise", "usbl=2,2,3",
                            "--loss", "huber:2", "--max-keyframes", 200)
    assert result.summary.cost == expected["cost"]
    assert result.summary.mode == "B"
    # A run file is read, and other options override it.
    result.save(tmp_path / "run")
    again = tandem.estimate("docking_a", config=tmp_path / "run/run.yaml")
    assert again.summary.cost == expected["cost"]


def test_every_option_of_a_command_is_an_argument():
    import inspect
    parameters = inspect.signature(tandem.estimate).parameters
    output = subprocess.run([program("estimate"), "--reference", "json"], capture_output=True, check=True)
    for option in json.loads(output.stdout)["options"]:
        if option["name"] not in {"json", "quiet", "print-config"}:
            assert option["name"].replace("-", "_") in parameters


def test_trajectories(docking):
    chaser, target = docking.chaser, docking.target
    n = docking.summary.keyframes
    assert len(target) == n and target.poses.shape == (n, 4, 4) and target.covariances.shape == (n, 6, 6)
    assert np.allclose(target.poses, target.se3.matrix())
    truth = docking.chaser_truth.at(target.t).se3.inverse().act(docking.target_truth.at(target.t).positions)
    error = np.linalg.norm(docking.relative.positions - truth, axis=1)
    assert error.mean() == pytest.approx(docking.summary.errors.all.position_mean_m, rel=1e-3)
    assert np.allclose(error, docking.errors["position_error_m"], atol=1e-2)
    middle = chaser.at(0.5 * (chaser.t[10] + chaser.t[11]))
    assert len(middle) == 1
    relative = docking.relative
    assert np.allclose((chaser.at(target.t).se3 @ relative.se3).minus(target.se3), 0, atol=1e-9)


def test_covariances_of_the_relative_pose(docking):
    S, errors = docking.relative.covariances, docking.errors
    position = np.linalg.norm([errors[f"three_sigma_{k}_m"] for k in "xyz"], axis=0)
    assert np.allclose(3 * np.sqrt(np.trace(S[:, :3, :3], axis1=1, axis2=2)), position, rtol=1e-3)
    rotation = np.radians([errors[f"three_sigma_r{k}_deg"] for k in "xyz"]).T
    assert np.allclose(3 * np.sqrt(np.diagonal(S, axis1=1, axis2=2))[:, 3:], rotation, rtol=1e-3)


def test_interpolated_covariances_are_exact_at_keyframes_and_bounded_between(docking):
    target = docking.target
    at = target.at(target.t)
    assert np.array_equal(at.covariances, target.covariances)
    between = target.at(0.5 * (target.t[:-1] + target.t[1:]))
    eigenvalues = np.linalg.eigvalsh(between.covariances)
    assert np.all(eigenvalues > 0)


def test_times_outside_the_trajectory_are_an_error(docking):
    with pytest.raises(tandem.BadInputError, match="covers"):
        docking.target.at(-1.0)
    with pytest.raises(tandem.BadInputError):
        docking.target.at(np.nan)


def test_trajectory_files(docking, tmp_path):
    pandas = pytest.importorskip("pandas")
    docking.target.to_tum(tmp_path / "target.tum")
    again = tandem.Trajectory.read(tmp_path / "target.tum")
    assert np.array_equal(again.positions, docking.target.positions)
    frame = docking.target.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == len(docking.target)


def test_tum_files_mark_poses_without_orientation(tmp_path):
    quaternions = [[np.nan] * 4, [0, 0, 1, 0], [np.nan] * 4]
    text = tandem.Trajectory([0, 1, 2], np.eye(3), quaternions).to_tum(tmp_path / "a.tum")
    assert "nan" not in text and text.count("# no orientation\n") == 2
    again = tandem.Trajectory.read(tmp_path / "a.tum")
    assert np.array_equal(again.quaternions, quaternions, equal_nan=True)
    assert np.array_equal(again.positions, np.eye(3))


def test_saved_results_are_read_again(docking, tmp_path):
    docking.save(tmp_path / "run")
    again = tandem.read_results(tmp_path / "run")
    assert type(again) is type(docking)
    assert again.summary.to_dict() == docking.summary.to_dict()
    assert np.array_equal(again.target.covariances, docking.target.covariances)
    assert again.fit.verdict == docking.fit.verdict
    with pytest.raises(tandem.BadInputError, match="not empty"):
        docking.save(tmp_path / "run")
    with pytest.raises(tandem.BadInputError, match="output folder"):
        tandem.read_results(tmp_path)


def test_results_can_be_pickled(docking):
    again = pickle.loads(pickle.dumps(docking))
    assert np.array_equal(again.target.positions, docking.target.positions)


def test_mode_b_has_no_orientation_where_none_is_estimated():
    target = tandem.estimate("docking_a", mode="B").target
    known = target.has_orientation
    assert known.any() and not known.all()
    assert np.isnan(target.poses[~known, :3, :3]).all() and np.isfinite(target.positions).all()
    assert np.isfinite(target.covariances[~known, :3, :3]).all()
    with pytest.raises(tandem.BadInputError, match="no orientation"):
        target.se3


def test_what_a_run_has_not_computed_is_missing():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    s = tandem.read_scenario("docking_a")
    without_truth = tandem.Scenario("own", noise=s.noise, odometry=s.odometry, measurements=s.measurements,
                                    keyframe_interval=s.settings["keyframe_interval"])
    result = tandem.estimate(without_truth, no_covariance=True, max_keyframes=60)
    assert result.errors == {}
    for trajectory in (result.chaser, result.target, result.relative):
        assert trajectory.covariances is None and trajectory.sigmas is None and "covariances" not in repr(trajectory)
    figures = pyplot.get_fignums()
    with pytest.raises(tandem.BadInputError, match="plot.errors: .* has no errors"):
        tandem.plot.errors(result)
    with pytest.raises(tandem.BadInputError, match="plot.consistency: .* no covariances"):
        tandem.plot.consistency(tandem.estimate("docking_a", no_covariance=True, max_keyframes=60))
    assert pyplot.get_fignums() == figures


def test_scenario_of_arrays_gives_the_same_cost(docking):
    s = tandem.read_scenario("docking_a")
    own = tandem.Scenario("docking_a", noise=s.noise, odometry=s.odometry, measurements=s.measurements,
                          truth_chaser=s.truth_chaser, truth_target=s.truth_target,
                          keyframe_interval=s.settings["keyframe_interval"])
    assert tandem.estimate(own).summary.cost == docking.summary.cost


@pytest.mark.parametrize("before, after", [
    ("t,x,y,z\n", "\ufefft,x,y,z\n"), ("t,x,y,z\n", "  # a comment\n \t\nt, x, y, z\n"), ("t,x", '"t","x"'), ("\n", "\r\n"),
])
def test_scenarios_are_read_as_commands_read_them(docking, tmp_path, before, after):
    s = tandem.read_scenario("docking_a")
    s.write(tmp_path / "copy")
    file = tmp_path / "copy" / "usbl.csv"
    file.write_bytes(file.read_text().replace(before, after).encode())
    again = tandem.read_scenario(tmp_path / "copy")
    assert np.array_equal(again.measurements["usbl"], s.measurements["usbl"])
    assert tandem.estimate(tmp_path / "copy", max_keyframes=10).summary["keyframes"] == 10


def test_wrong_cells_of_a_scenario_are_named(tmp_path):
    tandem.read_scenario("docking_a").write(tmp_path / "copy")
    file = tmp_path / "copy" / "usbl.csv"
    lines = file.read_text().splitlines()
    for wrong in ("1,2,3", "1,2,3,four"):
        file.write_text("\n".join([*lines[:5], wrong, *lines[5:]]))
        with pytest.raises(tandem.BadInputError, match=r"usbl\.csv:6: "):
            tandem.read_scenario(tmp_path / "copy")


def test_edits_of_a_read_scenario_count(docking, tmp_path):
    s = tandem.read_scenario("docking_a")
    assert tandem.estimate(s).summary.cost == docking.summary.cost
    s.noise["usbl"] = np.array([50, 50, 50])
    assert tandem.estimate(s).summary.cost == tandem.estimate("docking_a", noise={"usbl": (50, 50, 50)}).summary.cost
    s.measurements["usbl"][:, 1] += 100
    moved = tandem.estimate(s).summary.cost
    s.write(tmp_path / "edited")
    assert tandem.estimate(tmp_path / "edited").summary.cost == moved != docking.summary.cost
    again = tandem.read_scenario(tmp_path / "edited")
    assert np.array_equal(again.measurements["usbl"], s.measurements["usbl"])
    assert np.array_equal(again.measurements["optical"], s.measurements["optical"])
    del s.measurements["optical"]
    assert tandem.estimate(s).summary.cost < moved
    s.odometry.positions[5, 0] = np.inf
    with pytest.raises(tandem.BadInputError, match="odometry, row 5"):
        tandem.estimate(s)


def changed(**arguments):
    s = tandem.read_scenario("docking_a")
    known = dict(noise=s.noise, odometry=s.odometry, measurements=s.measurements)
    return tandem.estimate(tandem.Scenario("mine", **{**known, **arguments}))


@pytest.mark.parametrize("arguments, message", [
    (dict(odometry=None), "^odometry is missing"),
    (dict(noise={"usbl": [1, 1, 1]}), "^noise: noise lacks the key prior"),
    (dict(noise={**tandem.read_scenario("docking_a").noise, "usbl": [1, 1]}), "^noise usbl: usbl needs 3"),
    (dict(measurements={"usb": np.zeros((3, 4))}), "did you mean usbl"),
    (dict(measurements={"usbl": [[1, 0, 0, 0], [0, 0, 0, 0]]}), "^measurements usbl, row 1: .* of row 0"),
    (dict(grup="SE2"), "^grup: .*did you mean group"),
    (dict(sensors={"sonar": {"type": "rangefinder"}}), "^sensors sonar: "),
])
def test_messages_name_the_arguments_of_a_scenario(arguments, message):
    with pytest.raises(tandem.BadInputError, match=message) as error:
        changed(**arguments)
    assert "/tmp" not in str(error.value) and "scenario.yaml" not in str(error.value)


def test_results_are_values_of_options(docking):
    calibrated = tandem.calibrate("docking_a", max_keyframes=100)
    assert len(calibrated.noise["usbl"]) == 3
    assert tandem.estimate("docking_a", noise_from=calibrated).converged
    with pytest.raises(tandem.BadInputError, match="noise_from"):
        tandem.estimate("docking_a", noise_from=docking)


def test_changed_scenario(docking, tmp_path):
    s = tandem.read_scenario("docking_a")
    s.write(tmp_path / "copy")
    assert tandem.estimate(tmp_path / "copy").summary.cost == docking.summary.cost


@pytest.mark.parametrize("call, message", [
    (lambda: tandem.estimate("no_such_scenario"), "no_such_scenario"),
    (lambda: tandem.estimate(""), "empty"),
    (lambda: tandem.estimate(None), "Scenario"),
    (lambda: tandem.estimate("docking_a", mode="C"), "C"),
    (lambda: tandem.estimate("docking_a", mode=True), "mode"),
    (lambda: tandem.estimate("docking_a", noise={"usbl": [np.nan] * 3}), "usbl"),
    (lambda: tandem.estimate("docking_a", noise={"usbl": [1, 2]}), "usbl"),
    (lambda: tandem.estimate("docking_a", mode={"a": 1}), "dictionary"),
    (lambda: tandem.estimate("docking_a", robust="yes"), "robust"),
    (lambda: tandem.estimate("docking_a", time_limit=object()), "time_limit|time-limit"),
    (lambda: tandem.read_scenario("no_such_scenario"), "scenario.yaml"),
    (lambda: tandem.Scenario("x", noise={}, measurements={"usbl": np.zeros((3, 3))}), r"\(n, 4\)"),
    (lambda: tandem.Scenario("x", noise={}, measurements={"usbl": np.full((3, 4), np.nan)}), "NaN"),
    (lambda: tandem.Scenario("x", noise={"usbl": [np.inf]}), "finite"),
    (lambda: tandem.Scenario("x", noise={}, measurements={"sonar": np.zeros((3, 4))}), "sensors"),
    (lambda: tandem.run_study("no_such_study"), "no_such_study"),
])
def test_bad_input_is_one_sentence(call, message):
    with pytest.raises(tandem.BadInputError, match=message) as error:
        call()
    assert isinstance(error.value, ValueError) and "\n" not in str(error.value)


def test_unknown_options_are_type_errors():
    with pytest.raises(TypeError, match="solvr"):
        tandem.estimate("docking_a", solvr="ipopt")


def test_time_limit_gives_a_marked_result():
    with pytest.warns(tandem.IncompleteWarning):
        result = tandem.estimate("docking_a", solver="augmented-lagrangian", non_holonomic="hard", time_limit=0.01)
    assert not result.converged and result.incomplete


def test_interrupt_returns_the_best_point_marked():
    script = (
        "import _thread, threading, warnings, tandem\n"
        "warnings.simplefilter('ignore')\n"
        "threading.Timer(2.0, _thread.interrupt_main).start()\n"
        "r = tandem.estimate('docking_a', solver='nlopt:lbfgs')\n"
        "print('marked' if not r.converged else 'converged', len(r.target))\n")
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert output.returncode == 0, output.stderr
    assert output.stdout.split()[0] in ("marked", "converged") and int(output.stdout.split()[1]) > 0


def test_strict_runs_raise_with_the_result():
    with pytest.raises(tandem.MisfitError) as error:
        tandem.estimate("docking_a", strict=True, noise={"usbl": (0.01, 0.01, 0.01)})
    assert not error.value.result.fit.consistent


def test_runs_in_threads_do_not_disturb_each_other(docking):
    costs = []
    run = lambda: costs.append(tandem.estimate("docking_a").summary.cost)
    threads = [threading.Thread(target=run) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert costs == [docking.summary.cost] * 3


def test_runs_in_processes(docking):
    import multiprocessing
    for method in ("fork", "spawn"):
        with multiprocessing.get_context(method).Pool(2) as pool:
            results = pool.map(tandem.estimate, ["docking_a"] * 2)
        assert [r.summary.cost for r in results] == [docking.summary.cost] * 2


def test_other_commands():
    plan = tandem.plan("docking_a", at=600)
    assert plan.summary.vehicle == "REMUS 100" and len(plan.chaser) > 10 and "rudder" in plan.commands
    models = tandem.models("docking_a", models="constant-twist,constant-velocity", max_keyframes=100)
    assert len(models.table("models")["cost"]) == 2
    rendezvous = tandem.rendezvous(duration=10)
    assert "decoupled" in rendezvous.summary.methods.to_dict()
    simulated = tandem.simulate("docking", minutes=1)
    assert "usbl" in simulated.measurements
    assert tandem.estimate(simulated).converged


def test_a_plan_that_is_stopped_early_is_marked():
    with pytest.warns(tandem.IncompleteWarning):
        stopped = tandem.plan("docking_a", at=400, deadline=1)
    assert stopped.summary.status == "time-limit" and not stopped.converged


def test_plans_warn_of_steps_that_are_too_long():
    with pytest.warns(UserWarning, match="away from the plan"):
        plan = tandem.plan("docking_a", at=1000, horizon=30)
    assert plan.converged and len(plan.summary.warnings) == 1
    with pytest.raises(tandem.BadInputError, match="after the odometry, which covers"):
        tandem.plan("docking_a", at=1e5)


def test_estimates_name_what_the_data_do_not_determine():
    s = tandem.read_scenario("docking_a")
    del s.measurements["optical"]
    s.noise["constant_twist"] = [0.1] * 6
    estimate = tandem.estimate(s, roll_pitch="off", max_keyframes=100)
    assert not np.isfinite(estimate.target.sigmas).all()
    assert any("--non-holonomic soft" in finding for finding in estimate.summary.findings)
    assert "add a residual" not in estimate.summary.unobservable
    assert np.isfinite(tandem.estimate(s, non_holonomic="soft", max_keyframes=100).target.sigmas).all()


def test_recordings_are_imported_described_and_exported(docking, tmp_path):
    assert "tum" in tandem.export(docking, format="tum").summary.format
    assert tandem.info(tandem.read_scenario("docking_a")).summary.name == "docking_a"
    (tmp_path / "log.csv").write_text("t,depth\n0,1\n1,2\n")
    streams = tandem.import_log(tmp_path / "log.csv", list=True).summary["streams"]
    assert [s["rows"] for s in streams] == [2]
    with pytest.raises(tandem.BadInputError, match="map"):
        tandem.import_log(tmp_path / "log.csv")
    assert tandem.tune("docking_a", dry_run=True).converged


def test_temporary_folders_vanish():
    result = tandem.estimate("docking_a", max_keyframes=50)
    folder = result._folder
    assert folder.exists()
    del result
    assert not folder.exists()


def test_representations(docking):
    for thing in (docking, docking.target, docking.fit, docking.summary, tandem.read_scenario("docking_a")):
        assert "\n" not in repr(thing) and len(repr(thing)) < 300
        assert "<" in thing._repr_html_()


def test_import_time():
    start = time.process_time()
    subprocess.run([sys.executable, "-c", "import tandem"], check=True)
    times = os.times()
    assert times.children_user >= 0 and time.process_time() - start < 5


def test_newer_numpy_is_refused_in_one_sentence(tmp_path):
    package = pathlib.Path(tandem.__file__).parent
    script = (
        "import numpy, sys\nnumpy.__version__ = '2.1.0'\n"
        "import importlib.util\n"
        "spec = importlib.util.find_spec('tandem')\n"
        "sys.modules['tandem._build'] = type(sys)('tandem._build')\n"
        "sys.modules['tandem._build'].__dict__.update(VERSION='0', PYBIND11_VERSION='2.10.3', COMMANDS_FROM_PACKAGE='.')\n"
        "import tandem\n")
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True,
                            env={**os.environ, "PYTHONPATH": str(package.parent)})
    assert output.returncode != 0
    assert "does not support NumPy 2.1.0" in output.stderr.splitlines()[-1]


def test_forks_keep_the_files_of_a_result():
    script = ("import os, sys, tandem\n"
              "result = tandem.estimate('docking_a', max_keyframes=50)\n"
              "if os.fork() == 0: sys.exit(3)\n"
              "assert os.waitstatus_to_exitcode(os.wait()[1]) == 3\n"
              "assert len(result.target.t) == 50\n")
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)


def test_studies_can_be_listed():
    assert tandem.study("list").summary


def test_run_files_name_their_scenario(tmp_path):
    first = tandem.estimate("docking_a", max_keyframes=50, out=tmp_path / "run")
    assert tandem.estimate(config=tmp_path / "run" / "run.yaml").summary.cost == first.summary.cost
    with pytest.raises(tandem.BadInputError, match="expected a path"):
        tandem.estimate()


def test_results_stay_readable_after_a_change_of_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = tandem.estimate("docking_a", max_keyframes=50, out="run")
    monkeypatch.chdir("/")
    assert len(result.target.t) == 50
