"""Scenarios: recordings with their settings."""

import csv
import difflib
import hashlib
import json
import pathlib
import re
import shutil
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _build, _html
from ._core import parse_yaml
from ._paths import PathLike, TemporaryFolder
from .errors import BadInputError
from .results import Results
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
_TRAJECTORIES = {"odometry": "chaser_odometry.tum", "truth_chaser": "truth_chaser.tum",
                 "truth_target": "truth_target.tum"}
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

    Attributes of the same names may be changed, also in a scenario that read_scenario() has read; runs use the present
    values. docs/file_formats.md describes all settings, units and frames.

    >>> import tandem
    >>> s = tandem.read_scenario("docking_a")
    >>> s
    <Scenario docking_a: odometry 1.2e+03 s, usbl (158), optical (624), with truth>
    >>> s.measurements["usbl"].shape
    (158, 4)
    >>> tandem.Scenario("mine", noise={"usbl": [2, 2, 2]}, odometry=s.odometry, measurements={"usbl": [[0, 1, 2, 3]]})
    <Scenario mine: odometry 1.2e+03 s, usbl (1)>
    """

    def __init__(self, name: str, *, noise: Mapping[str, Any], odometry: Any = None,
                 measurements: Optional[Mapping[str, Any]] = None, sensors: Optional[Mapping[str, Any]] = None,
                 truth_chaser: Any = None, truth_target: Any = None, keyframe_interval: float = 1.0,
                 **settings: Any) -> None:
        self.name = name
        self.settings: Dict[str, Any] = {**settings, "keyframe_interval": float(keyframe_interval)}
        for what, mapping in (("noise", noise), ("measurements", measurements), ("sensors", sensors)):
            if mapping is not None and not isinstance(mapping, Mapping):
                raise BadInputError(f"{what}: expected a dictionary by the names of sensors, not {mapping!r}")
        self.noise: Dict[str, Any] = {k: _plain(v, f"noise {k}") for k, v in noise.items()}
        self.sensors: Dict[str, Dict[str, Any]] = {k: dict(v) for k, v in (sensors or {}).items()}
        self.odometry = _trajectory(odometry, "odometry")
        self.truth_chaser = _trajectory(truth_chaser, "truth_chaser")
        self.truth_target = _trajectory(truth_target, "truth_target")
        self.measurements: Dict[str, np.ndarray] = {}
        for sensor, rows in (measurements or {}).items():
            self.measurements[sensor] = _rows(rows, f"measurements {sensor}", self._columns(sensor))
        if odometry is not None and not len(self.odometry or ()):
            raise BadInputError("odometry: there are no rows")
        self._path: Optional[pathlib.Path] = None
        self._read: Dict[str, str] = {}  # fingerprints of the files of that folder, as the attributes show them
        self._headers: Dict[str, str] = {}  # of the files of measurements
        self._temporary: Any = None
        self.incomplete = ""

    @classmethod
    def _of_run(cls, command: str, summary: Dict[str, Any], folder: Optional[pathlib.Path],
                temporary: Any) -> Any:
        if folder is None:  # import_log(list=True) describes the recording only
            return Results(command, summary, None)
        scenario = read_scenario(folder)
        scenario._temporary = temporary
        return scenario

    def columns(self, sensor: str) -> Optional[Sequence[str]]:
        """Returns the names of the columns of a sensor or of "odometry", or None if the sensor has others.

        >>> import tandem
        >>> tandem.read_scenario("docking_a").columns("usbl")
        ('t', 'x', 'y', 'z')
        """
        return _COLUMNS["pose"] if sensor == "odometry" else self._columns(sensor)

    def _columns(self, sensor: str) -> Any:
        kind = self.sensors.get(sensor, {}).get("type", _PLAIN.get(sensor))
        if kind is None:
            near = difflib.get_close_matches(sensor, [*self.sensors, *_PLAIN, "odometry"], 1)
            raise BadInputError(f"measurements {sensor}: the sensor is unknown; " + (f"did you mean {near[0]}? Otherwise " if near else "") +
                                "add the sensor with its type to `sensors`")
        if kind in _COLUMNS and self.settings.get("group") == "SE2" and kind in ("position", "pose"):
            return None
        return _COLUMNS.get(str(kind))

    @property
    def path(self) -> Optional[pathlib.Path]:
        """Folder that the scenario was read from, or None."""
        return self._path

    def folder(self) -> "Union[pathlib.Path, ScenarioFolder]":
        """Returns the folder that the scenario was read from, or a temporary one with its present content, which lives
        as long as the returned object.

        >>> import os, tandem
        >>> "scenario.yaml" in os.listdir(tandem.read_scenario("docking_a").folder())
        True
        """
        if self._path is not None and not self._changed_files():
            return self._path
        folder = ScenarioFolder(self)
        self.write(folder)
        return folder

    def write(self, folder: PathLike) -> None:
        """Writes the scenario folder: scenario.yaml, TUM and CSV files. The folder must be new or empty.

        >>> import tandem, tempfile
        >>> s = tandem.read_scenario("docking_a")
        >>> s.noise["usbl"] = [2.0, 2.0, 3.0]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     s.write(folder)
        ...     tandem.read_scenario(folder).noise["usbl"]
        [2.0, 2.0, 3.0]
        """
        to = pathlib.Path(folder)
        if to.exists() and any(to.iterdir()):
            raise BadInputError(f"{to} is not empty; name a new folder")
        files = self._files()
        changed = self._changed_files()
        if self._path is not None:  # with the files that the attributes do not show
            shutil.copytree(self._path, to, dirs_exist_ok=True)
        to.mkdir(parents=True, exist_ok=True)
        for file in changed:
            if file in files:
                (to / file).write_text(files[file].text(), encoding="utf-8")
            else:
                (to / file).unlink()

    def _changed_files(self) -> List[str]:
        """Returns the names of the files that differ from those of the folder that the scenario was read from."""
        now = {name: file.fingerprint for name, file in self._files().items()}
        return sorted(name for name in {*now, *self._read} if now.get(name) != self._read.get(name))

    def _file_of(self, sensor: str) -> str:
        return str(self.sensors.get(sensor, {}).get("file", f"{sensor}.csv"))

    def _settings(self) -> str:
        """Returns the text of scenario.yaml."""
        sensors = {}
        for name, entry in self.sensors.items():
            if self._path is None or name in self.measurements or "file" not in entry:
                sensors[name] = {k: _plain(v, f"sensors {name} {k}") for k, v in entry.items()}
                sensors[name].setdefault("file", f"{name}.csv")
        document: Dict[str, Any] = {
            "name": self.name, "description": "written by Python", "source": "Python",
            **{k: _plain(v, k) for k, v in self.settings.items()},
            "noise": {k: _plain(v, f"noise {k}") for k, v in self.noise.items()}}
        if sensors:
            document["sensors"] = sensors
        # JSON is YAML. Each entry has its own line, so that messages can name it by the line number.
        lines = []
        for key, value in document.items():
            if isinstance(value, dict):
                lines.append(f"{key}:")
                lines += [f"  {k}: {json.dumps(v)}" for k, v in value.items()]
            else:
                lines.append(f"{key}: {json.dumps(value)}")
        return "\n".join(lines) + "\n"

    def _files(self) -> Dict[str, "_File"]:
        """Returns the files by name."""
        settings = self._settings()
        files = {"scenario.yaml": _File(settings, lambda: settings)}
        for attribute, file in _TRAJECTORIES.items():
            trajectory = _trajectory(getattr(self, attribute), attribute)
            if trajectory is not None:
                parts = (trajectory.t, trajectory.positions, trajectory.quaternions)
                files[file] = _File(_fingerprint(*parts), trajectory.to_tum)
        for sensor, rows in self.measurements.items():
            header = self._headers.get(sensor)
            columns = header.split(",") if header else self._columns(sensor)
            table = _rows(rows, f"measurements {sensor}", columns, header is not None)
            names = columns or ("t", *"xyz"[: table.shape[1] - 1])
            files[self._file_of(sensor)] = _File(
                _fingerprint(table), lambda names=names, table=table: _csv(names, table))  # type: ignore[misc]
        return files

    def _argument_of(self, file: str, line: Optional[int]) -> str:
        """Returns the argument that a line of a file comes from, for messages."""
        for attribute, name in _TRAJECTORIES.items():
            if file == name:
                return attribute + (f", row {line - 2}" if line is not None and line > 1 else "")
        for sensor in {*self.measurements, *self.sensors, *_PLAIN}:
            if file == self._file_of(sensor):
                return f"measurements {sensor}" + (f", row {line - 2}" if line is not None and line > 1 else "")
        section = entry = ""
        for text in self._settings().splitlines()[:line] if line is not None else ():
            key = text.partition(":")[0]
            section, entry = (section, key.strip()) if key.startswith(" ") else (key, "")
        return f"{section} {entry}".strip() or "settings"

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


class _File(NamedTuple):
    """A file of a scenario: what identifies its content, and a function that returns its text."""

    fingerprint: str
    text: Callable[[], str]


def _fingerprint(*arrays: np.ndarray) -> str:
    content = hashlib.sha256()
    for array in arrays:
        content.update(str(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    return content.hexdigest()


def _csv(columns: Sequence[str], rows: np.ndarray) -> str:
    lines = [",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"


class ScenarioFolder(TemporaryFolder):
    """Temporary folder for the files of a scenario."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self._scenario = scenario
        safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in scenario.name) or "_"
        self.path = self.path / safe

    def __fspath__(self) -> str:
        return str(self.path)

    def in_arguments(self, text: str) -> str:
        """Returns a message with the names of arguments instead of those of files in this folder."""
        def argument(match: "re.Match[str]") -> str:
            return self._scenario._argument_of(match.group(1), int(match.group(2)) if match.group(2) else None)
        text = re.sub(re.escape(str(self.path)) + r"/([\w.-]+\.(?:yaml|tum|csv))(?::(\d+))?", argument, text)
        text = re.sub(r"\b(\w+) \S+: (?=\1 (?:lacks|must))", r"\1: ", text)  # a mapping begins at its first key
        if ", row " in text:
            text = re.sub(r"\bline (\d+)", lambda m: f"row {int(m.group(1)) - 2}", text).replace("lines must", "rows must")
        return text.replace(str(self.path), f"scenario {self._scenario.name}")


def share(folder: str) -> pathlib.Path:
    """Returns a folder of the installed data: scenarios or vehicles."""
    return pathlib.Path(_build.__file__).parent / _build.DATA_FROM_PACKAGE / folder


def scenario_folder(path: PathLike) -> pathlib.Path:
    """Returns the folder of a scenario, or of a built-in one by its name."""
    folder = pathlib.Path(path)
    if (folder / "scenario.yaml").exists():
        return folder
    builtin = share("scenarios") / folder
    if folder.name != str(path) or not (builtin / "scenario.yaml").exists():
        raise BadInputError(f"{folder} is neither a folder with scenario.yaml nor the name of a built-in scenario")
    return builtin


def read_settings(path: PathLike) -> Scenario:
    """Reads a scenario without its data."""
    folder = scenario_folder(path)
    document = parse_yaml((folder / "scenario.yaml").read_text(encoding="utf-8"), str(folder / "scenario.yaml"))
    if not isinstance(document, dict):
        raise BadInputError(f"{folder / 'scenario.yaml'}: must be a mapping of keys to values")
    name = str(document.pop("name", folder.name))
    scenario = Scenario(name, noise=document.pop("noise", None) or {}, sensors=document.pop("sensors", None) or {},
                        **document)
    scenario._path = folder.resolve()
    return scenario


def _read_measurements(file: pathlib.Path) -> Tuple[List[str], np.ndarray]:
    """Returns the names of the columns of a CSV file, and its numbers. Empty cells are NaN."""
    columns: List[str] = []
    rows = []
    for number, line in enumerate(file.read_text(encoding="utf-8-sig").splitlines(), start=1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True))]
        if not columns:
            columns = cells
            continue
        if len(cells) != len(columns):
            raise BadInputError(f"{file}:{number}: expected {len(columns)} cells as in the header, not {len(cells)}")
        try:
            rows.append([float(cell or "nan") for cell in cells])
        except ValueError as error:
            raise BadInputError(f"{file}:{number}: {error}") from None
    return columns, np.array(rows).reshape(-1, len(columns))


def read_scenario(path: PathLike) -> Scenario:
    """Reads a scenario folder, or a built-in scenario by its name.

    >>> import tandem
    >>> tandem.read_scenario("docking_a").noise["usbl"]
    [1.72, 1.72, 1.72]
    """
    scenario = read_settings(path)
    folder = scenario._path
    assert folder is not None
    for attribute, file in _TRAJECTORIES.items():
        if (folder / file).exists():
            setattr(scenario, attribute, Trajectory.read(folder / file, attribute))
    files = {sensor: str(entry["file"]) for sensor, entry in scenario.sensors.items() if "file" in entry}
    files.update({s: f"{s}.csv" for s in _PLAIN if s not in files and (folder / f"{s}.csv").exists()})
    for sensor, file in files.items():
        columns, scenario.measurements[sensor] = _read_measurements(folder / file)
        scenario._headers[sensor] = ",".join(columns)
    scenario._read = {file: content.fingerprint for file, content in scenario._files().items()}
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


def _rows(value: Any, what: str, columns: Any, empty_cells: bool = False) -> np.ndarray:
    try:
        rows = np.array(value, dtype=float, order="C")
    except (TypeError, ValueError) as error:
        raise BadInputError(f"{what}: expected numbers: {error}") from None
    if rows.ndim != 2 or (columns is not None and rows.shape[1] != len(columns)):
        wanted = f"(n, {len(columns)}) with columns {' '.join(columns)}" if columns is not None else "(n, columns)"
        raise BadInputError(f"{what}: expected an array of shape {wanted}, not {rows.shape}")
    if not empty_cells and np.isnan(rows).any():
        raise BadInputError(f"{what}: row {int(np.argmax(np.isnan(rows).any(axis=1)))} contains NaN")
    return rows
