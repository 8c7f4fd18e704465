"""Online estimation in the process of Python, measurement by measurement."""

import os
import pathlib
from typing import Any, List, Optional

from ._core import OnlineEstimator as _OnlineEstimator
from ._core import VehicleModel
from ._options import words
from ._paths import PathLike, TemporaryFolder
from ._process import ScenarioLike, positional_words
from .errors import BadInputError
from .scenario import scenario_folder, share

# Keyword arguments that the compiled class takes; the others are options of `tandem track` that define the problem.
_OWN = ("window", "window_keyframes", "max_iterations", "cost_tolerance", "threads", "gate", "reset_after", "max_gap",
        "unconverged_after", "lost_after", "invalid_after", "soften", "newest")
_PROBLEM = ("mode", "model", "non_holonomic", "roll_pitch", "surge", "yaw_rate", "limits", "junction", "horizons",
            "robust", "without", "noise_from", "noise", "loss", "delay", "error", "alignment", "dvl_scale",
            "preintegrated_dvl")


class _Ready:
    """Representation of a subclass of a compiled class, which must not be used before its __init__ has succeeded."""

    _ready = False

    def _describe(self) -> str:
        return super().__repr__()

    def __repr__(self) -> str:
        return self._describe() if self._ready else f"<{type(self).__name__}: not initialised>"


class OnlineEstimator(_Ready, _OnlineEstimator):
    """Fixed-lag smoother of chaser and target for live measurements: the class that `tandem track` runs.

    Each call of add() updates the estimate before it returns. `Tracker` runs `tandem track` instead, which also repairs
    clocks, brings lines into order and writes results.

    Args:
        scenario: settings of the sensors and noise; its data are not read.
        options: window [s], window_keyframes, max_iterations and cost_tolerance of an update, threads; gate [standard
            deviations], reset_after, max_gap, unconverged_after, lost_after, invalid_after [s]; newest="hypotheses" for
            motion hypotheses of the target; soften=True to make hard constraints soft where they are infeasible. The
            options of `tandem.track` that define the problem have the same names and values, for example
            non_holonomic="hard", noise={"usbl": (2, 2, 3)}.

    Rows are those of the sensors' CSV files, with the time first, and poses are rows t x y z qx qy qz qw. Rows and
    estimates are in the frame of the scenario. Estimates, at the newest keyframe:

        started, has_target: whether chaser and target are estimated. Before, the others raise BadInputError.
        newest, oldest: times of the window [s]; keyframes: their number; cost.
        chaser: SE3; velocity: (3,) in the world [m/s], zero for a chaser that moves by odometry.
        target: SE3, or (3,) if its orientation is not estimated, or None; target_velocity: (3,) or None.
        predicted_chaser(h), predicted_target(h): the same h seconds ahead.
        relative_target(h): (position (3,), covariance (3, 3) or None) of the target h seconds ahead, along the axes of
            the chaser now; or None.
        covariance(): dictionary with those of chaser and target, right perturbations, position first [m, rad].
        window(): times (n,) and chaser poses of the window.
        updates(): dictionaries of the updates since the last call: t, new_keyframe, seconds, summary.
        rejected(): (sensor, reason) of queued measurements that were rejected since the last call.
        health: dictionary with chaser, target (state: none, aided, lost, invalid; age [s]), sensors, resets, …
        sensors: (name, columns) of each sensor.
        solve_to_convergence(), finish() at the end of the data, reset() discards the estimate.

    >>> import tandem
    >>> s = tandem.read_scenario("docking_a")
    >>> estimator = tandem.OnlineEstimator(s, window=30)
    >>> poses = iter(zip(s.odometry.t, s.odometry.positions, s.odometry.quaternions))
    >>> for fix in s.measurements["usbl"][:3]:
    ...     reason = estimator.add("usbl", fix)                 # None unless the fix is rejected
    ...     for t, p, q in poses:
    ...         reason = estimator.add("odometry", [t, *p, *q])
    ...         if t > fix[0]:
    ...             break
    >>> estimator.finish()
    >>> estimator.has_target, estimator.solve_to_convergence().converged
    (True, True)
    >>> position, covariance = estimator.relative_target(5.0)
    >>> position.shape, covariance.shape
    ((3,), (3, 3))
    >>> estimator.predicted_chaser(5.0).translation.shape, estimator.predicted_target(5.0).translation.shape
    ((3,), (3,))
    >>> len(estimator.updates()) > 0
    True
    >>> estimator.reset()
    >>> estimator.started
    False
    """

    def __init__(self, scenario: ScenarioLike, **options: Any) -> None:
        for name in options:
            if name not in _OWN + _PROBLEM:
                raise TypeError(f"OnlineEstimator: unknown option {name}; the options are {', '.join(_OWN + _PROBLEM)}")
        (folder,), self._keep = positional_words([scenario])
        problem = {name.replace("_", "-"): value for name, value in options.items() if name in _PROBLEM}
        own = {name: value for name, value in options.items() if name in _OWN and value is not None}
        super().__init__(os.fspath(scenario_folder(folder)), words("track", problem), own)
        self._ready = True

    def add(self, sensor: str, row: Any) -> Optional[str]:
        """Adds one measurement: a row of the sensor, the time first. Returns None, or why it is rejected."""
        return super().add(sensor, row) or None

    def _describe(self) -> str:
        return f"<OnlineEstimator: {self.keyframes} keyframes>" if self.started else "<OnlineEstimator: no estimate>"


class Vehicle(_Ready, VehicleModel):
    """A vehicle of the library, or one read from a YAML file (docs/file_formats.md), for Planner.

    Attributes: name, description, actuators (names), lower and upper (bounds of the commands), most_twist (bounds of
    the body twist in plans [m/s, rad/s]). step(state, command, dt, current) simulates it.

    >>> import tandem
    >>> remus = tandem.Vehicle("remus_100")
    >>> state = tandem.VehicleState(tandem.SE3(), twist=[1.5, 0, 0, 0, 0, 0])
    >>> for _ in range(10):
    ...     state = remus.step(state, remus.upper * [1, 0, 0], 0.5)
    >>> print(state.pose.translation[0] > 7)
    True
    >>> remus.dynamics(0.5).name, remus.actuator_lag(0.5).name        # residuals over 0.5 s
    ('VehicleDynamics', 'ActuatorLag')
    """

    def __init__(self, name_or_file: PathLike) -> None:
        path = pathlib.Path(name_or_file)
        folder = share("vehicles")
        if not path.exists():
            path = folder / f"{name_or_file}.yaml"
        if not path.exists():
            names: List[str] = sorted(p.stem for p in folder.glob("*.yaml"))
            raise BadInputError(f"there is no vehicle {os.fspath(name_or_file)!r}; there are {', '.join(names)}, or "
                                "give a YAML file")
        super().__init__(os.fspath(path))
        self._text = path.read_text(encoding="utf-8")
        self._ready = True

    def __reduce__(self) -> Any:
        return _vehicle_of_text, (type(self), self._text)


def _vehicle_of_text(kind: Any, text: str) -> Any:
    """Returns the vehicle of a pickle, which has the text of its file."""
    folder = TemporaryFolder()
    file = folder.path / "vehicle.yaml"
    file.write_text(text, encoding="utf-8")
    return kind(file)
