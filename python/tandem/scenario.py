"""Scenarios: recordings with their settings."""

import json
import os
import pathlib
import tempfile
from typing import Any, Dict, Mapping, Optional, Union

import numpy as np

from . import _build, _html
from ._core import parse_yaml
from .errors import BadInputError
from .trajectory import Trajectory

# Columns of the files of each type of sensor. docs/file_formats.md describes them.
_COLUMNS = {
    "position": ("t", "x", "y", "z"),
    "pose": ("t", "x", "y", "z", "qx", "qy", "qz", "qw"),
    "range_bearing": ("t", "range", "bearing"),
    "bearing": ("t", "bearing"),
    "range": ("t", "range"),
    "usbl_spherical": ("t", "range", "azimuth", "elevation"),
}
_PLAIN = {"usbl": "position", "optical": "pose"}  # sensors that need no entry in `sensors`


class Scenario:
    """A recording: settings, odometry, measurements and optional truth.

    Args:
        name: name in tables and messages.
        noise: standard deviations by name: prior, odometry, usbl, optical, constant_twist, …
        odometry: dead-reckoned chaser poses: a Trajectory, or an array of rows t x y z qx qy qz qw.
        measurements: rows of each sensor, starting with the time: usbl (t x y z), optical (t x y z qx qy qz qw), and
            those of `sensors`.
        sensors: settings of further sensors by name: type, sigma, position, orientation, delay, … (without file).
        truth_chaser, truth_target: true trajectories, which only metrics and plots read.
        settings: further keys of scenario.yaml, for example group="SE2", frame="NED-FRD".

    docs/file_formats.md describes all settings, units and frames.

    >>> import tandem
    >>> s = tandem.read_scenario("docking_a")
    >>> s
    <Scenario docking_a: odometry 1.2e+03 s, usbl (158), optical (624), with truth>
    >>> s.measurements["usbl"].shape
    (158, 4)
    """

    def __init__(self, name: str, *, noise: Mapping[str, Any], odometry: Any = None,
                 measurements: Optional[Mapping[str, Any]] = None, sensors: Optional[Mapping[str, Any]] = None,
                 truth_chaser: Any = None, truth_target: Any = None, keyframe_interval: float = 1.0,
                 **settings: Any) -> None:
        self.name = name
        self.settings: Dict[str, Any] = {**settings, "keyframe_interval": float(keyframe_interval)}
        self.noise: Dict[str, Any] = {k: _plain(v, f"noise {k}") for k, v in noise.items()}
        self.sensors: Dict[str, Dict[str, Any]] = {k: dict(v) for k, v in (sensors or {}).items()}
        self.odometry = _trajectory(odometry, "odometry")
        self.truth_chaser = _trajectory(truth_chaser, "truth_chaser")
        self.truth_target = _trajectory(truth_target, "truth_target")
        self.measurements: Dict[str, np.ndarray] = {}
        for sensor, rows in (measurements or {}).items():
            self.measurements[sensor] = _rows(rows, f"measurements {sensor}", self._columns(sensor))
        self._path: Optional[pathlib.Path] = None
        self._temporary: Any = None
        self.incomplete = ""

    @classmethod
    def _of_run(cls, command: str, summary: Dict[str, Any], folder: pathlib.Path, temporary: Any) -> "Scenario":
        scenario = read_scenario(folder)
        scenario._temporary = temporary
        return scenario

    def _columns(self, sensor: str) -> Any:
        kind = self.sensors.get(sensor, {}).get("type", _PLAIN.get(sensor))
        if kind is None:
            raise BadInputError(f"measurements {sensor}: add the sensor with its type to `sensors`")
        if kind in _COLUMNS and self.settings.get("group") == "SE2" and kind in ("position", "pose"):
            return None
        return _COLUMNS.get(str(kind))

    @property
    def path(self) -> Optional[pathlib.Path]:
        """Folder that the scenario was read from, or None."""
        return self._path

    def folder(self) -> "pathlib.Path | _TemporaryFolder":
        """Returns the folder that the scenario was read from, or writes a temporary one, which lives as long as the
        returned object."""
        if self._path is not None:
            return self._path
        folder = _TemporaryFolder(self.name)
        self.write(folder)
        return folder

    def write(self, folder: "Union[str, os.PathLike[str]]") -> None:
        """Writes the scenario folder: scenario.yaml, TUM and CSV files. The folder must be new or empty."""
        to = pathlib.Path(folder)
        if to.exists() and any(to.iterdir()):
            raise BadInputError(f"{to} is not empty; name a new folder")
        if self._path is not None:
            import shutil
            shutil.copytree(self._path, to, dirs_exist_ok=True)
            return
        to.mkdir(parents=True, exist_ok=True)
        sensors = {}
        for name, entry in self.sensors.items():
            sensors[name] = {k: _plain(v, f"sensors {name} {k}") for k, v in entry.items()}
            sensors[name]["file"] = f"{name}.csv"
        document: Dict[str, Any] = {"name": self.name, "description": "written by Python", "source": "Python",
                                    **{k: _plain(v, k) for k, v in self.settings.items()}, "noise": self.noise}
        if sensors:
            document["sensors"] = sensors
        # JSON is YAML. Each entry is on a line of its own, for messages with line numbers.
        lines = []
        for key, value in document.items():
            if isinstance(value, dict):
                lines.append(f"{key}:")
                lines += [f"  {k}: {json.dumps(v)}" for k, v in value.items()]
            else:
                lines.append(f"{key}: {json.dumps(value)}")
        (to / "scenario.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
        for file, trajectory in (("chaser_odometry", self.odometry), ("truth_chaser", self.truth_chaser),
                                 ("truth_target", self.truth_target)):
            if trajectory is not None:
                trajectory.to_tum(to / f"{file}.tum")
        for sensor, rows in self.measurements.items():
            columns = self._columns(sensor) or ("t", *"xyz"[: rows.shape[1] - 1])
            text = ",".join(columns) + "\n" + "".join(",".join(repr(float(v)) for v in row) + "\n" for row in rows)
            (to / f"{sensor}.csv").write_text(text, encoding="utf-8")

    def __repr__(self) -> str:
        parts = []
        if self.odometry is not None and len(self.odometry):
            parts.append(f"odometry {self.odometry.t[-1] - self.odometry.t[0]:.3g} s")
        parts += [f"{name} ({len(rows)})" for name, rows in self.measurements.items()]
        if self.truth_target is not None or self.truth_chaser is not None:
            parts.append("with truth")
        return f"<Scenario {self.name}: {', '.join(parts) or 'no data'}>"

    def _repr_html_(self) -> str:
        known = [t for t in (self.odometry, self.truth_target) if t is not None]
        return _html.plan_view(known, repr(self))


class _TemporaryFolder:
    """Folder of a scenario that exists as long as this object."""

    def __init__(self, name: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="tandem-scenario-")
        safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in name) or "_"
        self._path = os.path.join(self._folder.name, safe)

    def __fspath__(self) -> str:
        return self._path


def share(folder: str) -> pathlib.Path:
    """Returns a folder of the installed data: scenarios or vehicles."""
    return pathlib.Path(_build.__file__).parent / _build.DATA_FROM_PACKAGE / folder


def scenario_folder(path: "Union[str, os.PathLike[str]]") -> pathlib.Path:
    """Returns the folder of a scenario, or of a built-in one by its name."""
    folder = pathlib.Path(path)
    if (folder / "scenario.yaml").exists():
        return folder
    builtin = share("scenarios") / folder
    if folder.name != str(path) or not (builtin / "scenario.yaml").exists():
        raise BadInputError(f"{folder} is neither a folder with scenario.yaml nor the name of a built-in scenario")
    return builtin


def read_scenario(path: "Union[str, os.PathLike[str]]") -> Scenario:
    """Reads a scenario folder, or a built-in scenario by its name.

    >>> import tandem
    >>> tandem.read_scenario("docking_a").noise["usbl"]
    [1.72, 1.72, 1.72]
    """
    folder = scenario_folder(path)
    document = parse_yaml((folder / "scenario.yaml").read_text(encoding="utf-8"), str(folder / "scenario.yaml"))
    if not isinstance(document, dict):
        raise BadInputError(f"{folder / 'scenario.yaml'}: must be a mapping of keys to values")
    name = str(document.pop("name", folder.name))
    scenario = Scenario(name, noise=document.pop("noise", None) or {}, sensors=document.pop("sensors", None) or {},
                        **document)
    for attribute, file in (("odometry", "chaser_odometry"), ("truth_chaser", "truth_chaser"),
                            ("truth_target", "truth_target")):
        if (folder / f"{file}.tum").exists():
            setattr(scenario, attribute, Trajectory.read(folder / f"{file}.tum", attribute))
    files = {sensor: str(entry["file"]) for sensor, entry in scenario.sensors.items() if "file" in entry}
    files.update({s: f"{s}.csv" for s in _PLAIN if s not in files and (folder / f"{s}.csv").exists()})
    for sensor, file in files.items():
        lines = [x for x in (folder / file).read_text(encoding="utf-8").splitlines() if x and not x.startswith("#")]
        rows = [line.split(",") for line in lines[1:]]
        try:
            table = np.array([[float(x or "nan") for x in row] for row in rows]) if rows else np.empty((0, 0))
        except ValueError as error:
            raise BadInputError(f"{folder / file}: {error}") from None
        scenario.measurements[sensor] = table
    scenario._path = folder.resolve()
    return scenario


def _plain(value: Any, what: str) -> Any:
    """Returns a value of scenario.yaml as plain numbers, texts and lists."""
    if isinstance(value, np.ndarray) or isinstance(value, (list, tuple)):
        return [_plain(v, what) for v in value]
    if isinstance(value, Mapping):
        return {str(k): _plain(v, what) for k, v in value.items()}
    if isinstance(value, (bool, str, int)) or value is None:
        return value
    if isinstance(value, (float, np.floating, np.integer)):
        if not np.isfinite(value):
            raise BadInputError(f"{what}: {value} is not a finite number")
        return float(value)
    raise BadInputError(f"{what}: a {type(value).__name__} cannot be a setting of a scenario")


def _trajectory(value: Any, what: str) -> Optional[Trajectory]:
    if value is None or isinstance(value, Trajectory):
        return value
    rows = _rows(value, what, _COLUMNS["pose"])
    return Trajectory(rows[:, 0], rows[:, 1:4], rows[:, 4:], name=what)


def _rows(value: Any, what: str, columns: Any) -> np.ndarray:
    try:
        rows = np.array(value, dtype=float, order="C")
    except (TypeError, ValueError) as error:
        raise BadInputError(f"{what}: expected numbers: {error}") from None
    if rows.ndim != 2 or (columns is not None and rows.shape[1] != len(columns)):
        wanted = f"(n, {len(columns)}) with columns {' '.join(columns)}" if columns is not None else "(n, columns)"
        raise BadInputError(f"{what}: expected an array of shape {wanted}, not {rows.shape}")
    if np.isnan(rows).any():
        raise BadInputError(f"{what}: row {int(np.argmax(np.isnan(rows).any(axis=1)))} contains NaN")
    return rows
