"""Trajectories: poses over time, with covariances."""

import pathlib
from typing import Any, Dict, Optional

import numpy as np

from ._core import SE3, SO3
from ._paths import PathLike
from ._table import read_table
from .errors import BadInputError

_NO_ORIENTATION = "# no orientation"  # the comment before a pose of a TUM file without an orientation
ENTRIES = [f"c{i}{j}" for i in range(1, 7) for j in range(1, 7)]


class Trajectory:
    """Poses T_world_body at increasing times.

    Attributes:
        t: times [s], shape (n,).
        positions: positions in the world [m], shape (n, 3).
        quaternions: Hamilton quaternions x y z w, shape (n, 4). NaN where only the position is estimated (Mode B).
        twists: body velocities [m/s] and angular rates [rad/s], shape (n, 6), or None.
        covariances: covariances of right perturbations, position first [m², m rad, rad²], shape (n, 6, 6), or None.
            NaN where nothing is estimated.
        name: "chaser" or "target".

    >>> import numpy as np, tandem
    >>> x = tandem.Trajectory([0, 10], np.array([[0, 0, 0], [10, 0, 0]]), np.array([[0, 0, 0, 1], [0, 0, 0, 1]]))
    >>> x.at([2.5]).positions
    array([[2.5, 0. , 0. ]])
    """

    def __init__(self, t: Any, positions: Any, quaternions: Any, twists: Any = None, covariances: Any = None,
                 name: str = "trajectory") -> None:
        self.name = name
        self.t = _checked(t, (None,), "t")
        n = len(self.t)
        self.positions = _checked(positions, (n, 3), "positions")
        self.quaternions = _checked(quaternions, (n, 4), "quaternions")
        self.twists: Optional[np.ndarray] = None if twists is None else _checked(twists, (n, 6), "twists")
        self.covariances: Optional[np.ndarray] = (
            None if covariances is None else _checked(covariances, (n, 6, 6), "covariances"))
        if not np.all(np.isfinite(self.t)) or np.any(np.diff(self.t) < 0):
            raise BadInputError("t: the times must be finite and increasing")

    @classmethod
    def from_poses(cls, t: Any, poses: Any, name: str = "trajectory") -> "Trajectory":
        """Constructs a trajectory from poses: an array of SE3, or matrices of shape (n, 4, 4).

        >>> import tandem
        >>> tandem.Trajectory.from_poses([0.0, 1.0], tandem.SE3.identity(2)).positions.shape
        (2, 3)
        """
        elements = poses if isinstance(poses, SE3) else SE3.from_matrix(poses)
        return cls(t, elements.translation, elements.quaternion(order="xyzw"), name=name)

    @classmethod
    def read(cls, path: PathLike, name: str = "trajectory") -> "Trajectory":
        """Reads a TUM file (t x y z qx qy qz qw), or one of the CSV files that Tandem writes.

        The file `chaser_full.csv` beside a TUM file `chaser.tum` has twists and covariances.

        >>> import os, tandem, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = os.path.join(folder, "chaser.tum")
        ...     text = tandem.Trajectory.from_poses([0.0, 1.0], tandem.SE3.identity(2)).to_tum(file)
        ...     tandem.Trajectory.read(file, "chaser")
        <Trajectory chaser: 2 states, 0 s to 1 s>
        """
        file = pathlib.Path(path)
        if file.suffix != ".csv":
            lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
            table = np.loadtxt(lines, ndmin=2)
            lines = [line for line in lines if line and (line[0] != "#" or line == _NO_ORIENTATION)]
            unknown = [before == _NO_ORIENTATION for before, line in zip([""] + lines, lines) if line[0] != "#"]
            if table.size == 0:
                table = np.empty((0, 8))
            if table.shape[1] != 8:
                raise BadInputError(f"{file}: a TUM file has 8 columns, not {table.shape[1]}")
            table[unknown, 4:] = np.nan
            return cls(table[:, 0], table[:, 1:4], table[:, 4:], name=name)
        return cls._of_columns(read_table(file), name)

    @classmethod
    def _of_columns(cls, c: Dict[str, np.ndarray], name: str) -> "Trajectory":
        def columns(*names: str) -> Optional[np.ndarray]:
            return np.stack([c[k] for k in names], axis=1) if all(k in c for k in names) else None

        def known(values: Optional[np.ndarray]) -> Optional[np.ndarray]:
            """Returns None if the run has computed none of the values, which are then NaN in the file."""
            return None if values is None or (values.size and not np.isfinite(values).any()) else values

        positions = columns("x", "y", "z")
        assert positions is not None
        quaternions = columns("qx", "qy", "qz", "qw")
        covariances = known(columns(*ENTRIES))
        return cls(c["t"], positions, np.full((len(positions), 4), np.nan) if quaternions is None else quaternions,
                   known(columns("vx", "vy", "vz", "wx", "wy", "wz")),
                   None if covariances is None else covariances.reshape(-1, 6, 6), name)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def has_orientation(self) -> np.ndarray:
        """Whether the orientation is estimated at each time, shape (n,)."""
        return np.all(np.isfinite(self.quaternions), axis=1)

    @property
    def se3(self) -> SE3:
        """The poses as an array of SE3. Raises BadInputError if an orientation is missing."""
        if not np.all(self.has_orientation):
            missing = int(np.sum(~self.has_orientation))
            raise BadInputError(f"{self.name}: {missing} of {len(self)} states have no orientation; use "
                                "positions, or select them by has_orientation")
        return SE3.from_quaternion(self.quaternions, self.positions, order="xyzw")

    @property
    def poses(self) -> np.ndarray:
        """Matrices of shape (n, 4, 4). The rotation is NaN where the orientation is not estimated."""
        result = np.tile(np.eye(4), (len(self), 1, 1))
        known = self.has_orientation
        result[:, :3, 3] = self.positions
        result[~known, :3, :3] = np.nan
        if np.any(known):
            result[known, :3, :3] = SO3.from_quaternion(self.quaternions[known], order="xyzw").matrix()
        return result

    @property
    def sigmas(self) -> Optional[np.ndarray]:
        """Standard deviations [m, rad], shape (n, 6), or None."""
        if self.covariances is None:
            return None
        return np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))

    def at(self, times: Any) -> "Trajectory":
        """Returns the states at other times, interpolated on SE(3) between neighbours.

        Covariances are upper bounds to first order: with Jacobians (1-s)A and sB of the geodesic, the covariance is at
        most (1-s) A P0 A' + s B P1 B', whatever the correlation of the neighbours. Twists are interpolated linearly.
        States without orientation are interpolated in their positions. Raises BadInputError outside the time range.
        """
        t = np.atleast_1d(_checked(times, (None,) if np.ndim(times) else (), "times"))
        if len(self) == 0:
            raise BadInputError(f"{self.name}: an empty trajectory has no states")
        if np.any(~(t >= self.t[0])) or np.any(~(t <= self.t[-1])):
            raise BadInputError(f"times: {self.name} covers {self.t[0]:g} s to {self.t[-1]:g} s only")
        right = np.clip(np.searchsorted(self.t, t, side="left"), 1, max(len(self) - 1, 1))
        left = right - 1
        right = np.minimum(right, len(self) - 1)
        gap = self.t[right] - self.t[left]
        s = np.where(gap > 0, (t - self.t[left]) / np.where(gap > 0, gap, 1), 0.0)
        w = s[:, None]
        positions = (1 - w) * self.positions[left] + w * self.positions[right]
        quaternions = np.full((len(t), 4), np.nan)
        twists = None if self.twists is None else (1 - w) * self.twists[left] + w * self.twists[right]
        covariances = None
        if self.covariances is not None:
            w3 = s[:, None, None]
            covariances = (1 - w3) * self.covariances[left] + w3 * self.covariances[right]
        known = self.has_orientation[left] & self.has_orientation[right]
        if np.any(known):
            x = SE3.from_quaternion(self.quaternions[left[known]], self.positions[left[known]], order="xyzw")
            y = SE3.from_quaternion(self.quaternions[right[known]], self.positions[right[known]], order="xyzw")
            z, by_x, by_y = x.interpolate(y, s[known], jacobians=True)
            positions[known] = z.translation
            quaternions[known] = z.quaternion(order="xyzw")
            if covariances is not None and self.covariances is not None:
                P0, P1 = self.covariances[left[known]], self.covariances[right[known]]
                c0 = 1 / np.where(s[known] < 1, 1 - s[known], np.inf)[:, None, None]
                c1 = 1 / np.where(s[known] > 0, s[known], np.inf)[:, None, None]
                part0 = by_x @ np.where(np.isfinite(c0) & (c0 > 0), P0, 0) @ by_x.transpose(0, 2, 1) * c0
                part1 = by_y @ np.where(c1 > 0, P1, 0) @ by_y.transpose(0, 2, 1) * c1
                covariances[known] = part0 + part1
        # A time that is a keyframe has exactly its state.
        for side in (left, right):
            same = t == self.t[side]
            quaternions[same] = self.quaternions[side[same]]
            positions[same] = self.positions[side[same]]
            if twists is not None and self.twists is not None:
                twists[same] = self.twists[side[same]]
            if covariances is not None and self.covariances is not None:
                covariances[same] = self.covariances[side[same]]
        return Trajectory(t, positions, quaternions, twists, covariances, self.name)

    def to_tum(self, path: Optional[PathLike] = None) -> str:
        """Returns the text of a TUM file (t x y z qx qy qz qw), and writes it to `path` if given.

        >>> import tandem
        >>> print(tandem.Trajectory.from_poses([0.5], tandem.SE3.identity(1)).to_tum())
        # t[s] x[m] y[m] z[m] qx qy qz qw
        0.5 0.0 0.0 0.0 0.0 0.0 0.0 1.0
        <BLANKLINE>
        """
        lines = ["# t[s] x[m] y[m] z[m] qx qy qz qw"]
        for t, p, q, known in zip(self.t, self.positions, self.quaternions, self.has_orientation):
            if not known:
                lines.append(_NO_ORIENTATION)
            lines.append(" ".join(repr(float(v)) for v in (t, *p, *(q if known else (0, 0, 0, 1)))))
        text = "\n".join(lines) + "\n"
        if path is not None:
            pathlib.Path(path).write_text(text, encoding="utf-8")
        return text

    def to_pandas(self) -> Any:
        """Returns a pandas DataFrame indexed by t, with the columns of the CSV files. Needs pandas.

        >>> import tandem
        >>> frame = tandem.Trajectory.from_poses([0.5], tandem.SE3.identity(1)).to_pandas()
        >>> list(frame.columns)
        ['x', 'y', 'z', 'qx', 'qy', 'qz', 'qw']
        """
        import pandas  # type: ignore[import]
        columns = {"x": self.positions[:, 0], "y": self.positions[:, 1], "z": self.positions[:, 2]}
        columns.update(zip(("qx", "qy", "qz", "qw"), self.quaternions.T))
        if self.twists is not None:
            columns.update(zip(("vx", "vy", "vz", "wx", "wy", "wz"), self.twists.T))
        if self.covariances is not None:
            columns.update(zip(ENTRIES, self.covariances.reshape(len(self), 36).T))
        return pandas.DataFrame(columns, index=pandas.Index(self.t, name="t"))

    def __repr__(self) -> str:
        if len(self) == 0:
            return f"<Trajectory {self.name}: empty>"
        extra = "" if self.covariances is None else ", with covariances"
        return f"<Trajectory {self.name}: {len(self)} states, {self.t[0]:g} s to {self.t[-1]:g} s{extra}>"

    def _repr_html_(self) -> str:
        from ._html import plan_view
        return plan_view([self], repr(self))


def _checked(value: Any, shape: Any, what: str) -> np.ndarray:
    try:
        array = np.array(value, dtype=float, order="C")
    except (TypeError, ValueError) as error:
        raise BadInputError(f"{what}: expected numbers: {error}") from None
    if array.ndim != len(shape) or any(w is not None and w != s for s, w in zip(array.shape, shape)):
        wanted = "(" + ", ".join("n" if w is None else str(w) for w in shape) + ("," if len(shape) == 1 else "") + ")"
        raise BadInputError(f"{what}: expected shape {wanted}, not {array.shape}")
    return array
