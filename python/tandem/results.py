"""Results of runs."""

import json
import pathlib
import shutil
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from . import _html
from ._core import SO3, parse_yaml
from ._paths import PathLike, TemporaryFolder
from ._table import read_table
from .errors import BadInputError
from .summary import FitReport, Summary
from .trajectory import ENTRIES, Trajectory


class Results:
    """Result of a run: the summary, and the files of its folder as tables.

    Attributes:
        command: the command that ran.
        summary: its JSON document.
        incomplete: why the run is incomplete, one sentence; empty if it is complete.

    >>> import tandem
    >>> result = tandem.info("docking_a")
    >>> isinstance(result, tandem.Results), result.command, result.summary.name
    (True, 'info', 'docking_a')
    """

    def __init__(self, command: str, summary: Dict[str, Any], folder: Optional[pathlib.Path],
                 temporary: Optional[TemporaryFolder] = None) -> None:
        self.command = command
        self.summary = Summary(summary)
        self.incomplete = ""
        self._folder = folder
        self._temporary = temporary  # keeps the folder while the result exists
        self._tables: Dict[str, Dict[str, np.ndarray]] = {}

    @classmethod
    def _of_run(cls, command: str, summary: Dict[str, Any], folder: Optional[pathlib.Path],
                temporary: Optional[TemporaryFolder]) -> Any:
        return cls(command, summary, folder, temporary)

    def folder(self) -> pathlib.Path:
        """Returns the folder of the run's files, which is temporary unless the run had an `out`.

        >>> import tandem
        >>> result = tandem.estimate("docking_a", max_keyframes=20)
        >>> (result.folder() / "target_full.csv").exists()
        True
        """
        if self._folder is None:
            raise BadInputError(f"the run of {self.command} has no files")
        return self._folder

    @property
    def noise(self) -> Dict[str, Any]:
        """Calibrated standard deviations by name, as in Scenario.noise. Only of calibrate()."""
        if "noise.yaml" not in self.files:
            raise BadInputError(f"a run of {self.command} does not calibrate noise; use tandem.calibrate()")
        text = (self.folder() / "noise.yaml").read_text(encoding="utf-8")
        return dict(parse_yaml(text, "noise.yaml")["noise"])

    @property
    def files(self) -> List[str]:
        """Names of the result files."""
        return sorted(p.name for p in self._folder.iterdir() if not p.name.startswith(".")) if self._folder else []

    def table(self, name: str) -> Dict[str, np.ndarray]:
        """Returns the columns of a CSV file by name; `name` is with or without ".csv".

        >>> import tandem
        >>> result = tandem.estimate("docking_a", max_keyframes=20)
        >>> len(result.table("errors")["t"]) == len(result.target)
        True
        """
        file = name if name.endswith(".csv") else name + ".csv"
        if file not in self._tables:
            if self._folder is None or file not in self.files:
                known = ", ".join(f for f in self.files if f.endswith(".csv"))
                raise BadInputError(f"the run has no table {file}; it has {known or 'none'}")
            self._tables[file] = read_table(self._folder / file)
        return dict(self._tables[file])

    def save(self, folder: PathLike) -> None:
        """Copies the files of the run to a folder, which read_results() reads. The folder must be new or empty.

        >>> import tandem, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     tandem.estimate("docking_a", max_keyframes=20).save(folder)
        ...     len(tandem.read_results(folder).target)
        20
        """
        to = pathlib.Path(folder)
        if to.exists() and any(to.iterdir()):
            raise BadInputError(f"{to} is not empty; name a new folder")
        to.mkdir(parents=True, exist_ok=True)
        if self._folder is not None:
            shutil.copytree(self._folder, to, dirs_exist_ok=True)
        if not (to / "summary.json").exists():
            (to / "summary.json").write_text(json.dumps(self.summary.to_dict(), indent=2), encoding="utf-8")

    @property
    def converged(self) -> bool:
        """Whether the run is complete."""
        return not self.incomplete

    def __repr__(self) -> str:
        name = self.summary.get("scenario") or self.summary.get("name")
        return f"<{self.command}{f' of {name}' if name else ''}: {self.incomplete or self.summary.get('message') or 'complete'}>"

    def __getstate__(self) -> Dict[str, Any]:
        files = {} if self._folder is None else {f: (self._folder / f).read_bytes() for f in self.files
                                                 if (self._folder / f).is_file()}
        return {"command": self.command, "summary": self.summary.to_dict(), "incomplete": self.incomplete,
                "files": files}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        temporary = TemporaryFolder()
        for name, content in state["files"].items():
            (temporary.path / name).write_bytes(content)
        self.__init__(state["command"], state["summary"], temporary.path, temporary)  # type: ignore[misc]
        self.incomplete = state["incomplete"]


class _Trajectories(Results):
    """Result with trajectories in files, each of which is read once."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._trajectories: Dict[str, Optional[Trajectory]] = {}

    def _trajectory(self, name: str) -> Optional[Trajectory]:
        if name not in self._trajectories:
            file = next((f for f in (f"{name}_full.csv", f"{name}.tum") if f in self.files), None)
            self._trajectories[name] = Trajectory.read(self.folder() / file, name) if file else None
        return self._trajectories[name]

    def _required(self, name: str) -> Trajectory:
        trajectory = self._trajectory(name)
        if trajectory is None:
            raise BadInputError(f"the run has no trajectory of the {name}")
        return trajectory

    @property
    def chaser(self) -> Trajectory:
        """Estimated trajectory of the chaser."""
        return self._required("chaser")

    @property
    def chaser_truth(self) -> Optional[Trajectory]:
        """True trajectory of the chaser, or None without truth."""
        return self._trajectory("chaser_truth")

    @property
    def errors(self) -> Dict[str, np.ndarray]:
        """Errors with respect to the truth and 3σ bounds, by column of errors.csv; empty without truth."""
        table = self.table("errors") if "errors.csv" in self.files else {}
        known = any(np.isfinite(column).any() for name, column in table.items() if name.startswith("error_"))
        return table if known else {}

    @property
    def fit(self) -> Optional[FitReport]:
        """Fit report, or None if the run has none."""
        return FitReport(self.summary["fit"]) if "fit" in self.summary else None


def _indices_of(times: np.ndarray, known: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Returns the index of each time in the increasing times `known`, and whether it is there within 1 ns."""
    index = np.clip(np.searchsorted(known, times - 1e-9), 0, len(known) - 1)
    return index, np.isclose(known[index], times, rtol=0, atol=1e-9)


class Navigation(_Trajectories):
    """Result of navigate().

    >>> import tandem
    >>> result = tandem.navigate(tandem.simulate("dive", minutes=1, seed=1))
    >>> isinstance(result, tandem.Navigation), result.chaser.covariances.shape[1:]
    (True, (6, 6))
    """

    def _repr_html_(self) -> str:
        return _html.plan_view([self.chaser], repr(self))


class Estimate(_Trajectories):
    """Result of estimate(): trajectories of chaser and target.

    >>> import tandem
    >>> result = tandem.estimate("docking_a", max_keyframes=20)
    >>> isinstance(result, tandem.Estimate), result.target.covariances.shape
    (True, (20, 6, 6))
    """

    @property
    def target(self) -> Trajectory:
        """Estimated trajectory of the target."""
        return self._required("target")

    @property
    def target_truth(self) -> Optional[Trajectory]:
        """True trajectory of the target, or None without truth."""
        return self._trajectory("target_truth")

    @property
    def relative(self) -> Trajectory:
        """The target in the chaser's body frame, T_chaser_target, at the times of the target.

        Its covariances need the cross covariances of the run, and are NaN where the target has no orientation; they are
        None if the run has none.
        """
        chaser, target = self.chaser.at(self.target.t), self.target
        to_body = chaser.se3.inverse()
        quaternions = np.full_like(target.quaternions, np.nan)
        known = target.has_orientation
        if np.any(known):
            rotation = to_body.rotation.matrix()[known] @ target.poses[known, :3, :3]
            quaternions[known] = SO3(rotation).quaternion(order="xyzw")
        return Trajectory(target.t, to_body.act(target.positions), quaternions,
                          covariances=self._relative_covariances(chaser, target), name="relative")

    def _relative_covariances(self, chaser: Trajectory, target: Trajectory) -> Optional[np.ndarray]:
        if "cross_covariance.csv" not in self.files or chaser.covariances is None or target.covariances is None:
            return None
        table = self.table("cross_covariance")
        if not all(name in table for name in ENTRIES):  # the target is a point everywhere
            return None
        cross = np.stack([table[name] for name in ENTRIES], axis=1).reshape(-1, 6, 6)
        row, has_cross = _indices_of(target.t, table["t"])  # only keyframes have a cross covariance
        known = target.has_orientation & has_cross & _indices_of(target.t, self.chaser.t)[1]
        if not np.any(known):
            return None
        result = np.full((len(target), 6, 6), np.nan)
        # Right perturbations: d(C^-1 T) = dT - Ad(T^-1 C) dC.
        at = target.t[known]
        A = (target.at(at).se3.inverse() @ chaser.at(at).se3).adjoint()
        At, C = A.transpose(0, 2, 1), cross[row[known]]
        assert chaser.covariances is not None and target.covariances is not None
        result[known] = (target.covariances[known] + A @ chaser.covariances[known] @ At - A @ C -
                         C.transpose(0, 2, 1) @ At)
        return result

    @property
    def weights(self) -> Dict[str, np.ndarray]:
        """Robust weights of the measurements, by column of weights.csv."""
        return self.table("weights")

    def _repr_html_(self) -> str:
        return _html.plan_view([self.chaser, self.target], repr(self))


class Plan(Results):
    """Result of plan(): the planned motion of the chaser and the predicted target.

    >>> import tandem
    >>> result = tandem.plan("docking_a", at=600, horizon=10, step=0.5)
    >>> isinstance(result, tandem.Plan), len(result.chaser) == len(result.target)
    (True, True)
    """

    @property
    def chaser(self) -> Trajectory:
        """Planned trajectory of the chaser."""
        return Trajectory._of_columns(self.table("planned_chaser"), "planned chaser")

    @property
    def target(self) -> Trajectory:
        """Predicted trajectory of the target."""
        return Trajectory._of_columns(self.table("predicted_target"), "predicted target")

    @property
    def commands(self) -> Dict[str, np.ndarray]:
        """Commands of the actuators over time, by column of commands.csv."""
        return self.table("commands")

    def _repr_html_(self) -> str:
        return _html.plan_view([self.chaser, self.target], repr(self))


def read_results(folder: PathLike) -> Any:
    """Returns the result of a run from its output folder, as the function that ran the command did.

    >>> import tandem, tempfile, pathlib
    >>> folder = pathlib.Path(tempfile.mkdtemp()) / "run"
    >>> result = tandem.estimate("docking_a", out=folder)
    >>> tandem.read_results(folder).summary.cost == result.summary.cost
    True
    """
    path = pathlib.Path(folder)
    summary_file, run_file = path / "summary.json", path / "run.yaml"
    summary: Dict[str, Any] = {}
    if summary_file.exists():
        try:
            summary = json.loads(summary_file.read_text(encoding="utf-8"))
        except ValueError as error:
            raise BadInputError(f"{summary_file}: invalid JSON: {error}") from None
    if not summary and not run_file.exists():
        raise BadInputError(f"{path} is not the output folder of a run; it has neither summary.json nor run.yaml")
    command = str(summary.get("schema", "")).partition("/")[0].rpartition(".")[2]
    if not command and run_file.exists():
        command = str(parse_yaml(run_file.read_text(encoding="utf-8"), str(run_file))["command"])
    kind = {"estimate": Estimate, "navigate": Navigation, "plan": Plan, "track": Estimate}.get(command, Results)
    result = kind(command, summary, path)
    if summary.get("status", "converged") != "converged":
        result.incomplete = str(summary.get("message", summary["status"]))
    return result
