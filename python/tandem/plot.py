"""Figures by matplotlib: sized for a journal column, distinguishable without colour vision.

Each function draws on `ax`, or on a new figure of 3.5 in width, and returns the axes.
"""

from typing import Any, Dict, Optional, Sequence

import numpy as np

from ._html import COLOURS
from ._paths import PathLike
from .errors import BadInputError
from .results import Plan, Results
from .summary import FitReport
from .trajectory import Trajectory

_BLUE, _ORANGE, _GREEN = COLOURS[:3]
_GREY = "#777777"


def _axes(ax: Any, rows: int = 1, height: float = 2.4) -> Any:
    """Returns `ax`, or the axes of a new figure with these rows and this height [in]; an array of axes if rows > 1."""
    if ax is not None:
        return ax
    try:
        import matplotlib.pyplot as plt  # type: ignore[import]
    except ImportError:
        raise ImportError("tandem.plot needs matplotlib; install python3-matplotlib") from None
    with plt.rc_context({"font.size": 8, "axes.linewidth": 0.6, "lines.linewidth": 1.0}):
        _, axes = plt.subplots(rows, 1, figsize=(3.5, height), sharex=rows > 1, squeeze=False, constrained_layout=True)
    for a in axes[:, 0]:
        a.tick_params(labelsize=8)
    return axes[0, 0] if rows == 1 else axes[:, 0]


def _as_plan_view(ax: Any) -> Any:
    """Labels axes that show x and y with equal scales."""
    ax.set_xlabel("x [m]", fontsize=8)
    ax.set_ylabel("y [m]", fontsize=8)
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend(fontsize=8, frameon=False)
    return ax


def _described(thing: Any) -> str:
    """Returns what an argument is, for messages."""
    return f"the result of {thing.command}" if isinstance(thing, Results) else f"a {type(thing).__name__}"


def _part(result: Any, name: str) -> Any:
    """Returns a part of a result, for example "chaser", or None if the result has no such part."""
    try:
        return getattr(result, name, None)
    except BadInputError:
        return None


def _rendezvous_trajectories(result: Results) -> Dict[str, Trajectory]:
    """Returns the true positions of chaser and target in a simulated rendezvous."""
    table = result.table("rendezvous")
    unknown = np.full((len(table["t"]), 4), np.nan)
    return {name: Trajectory(table["t"], np.column_stack([table[f"{name}_{k}_m"] for k in "xyz"]), unknown, name=name)
            for name in ("chaser", "target")}


def trajectories(result: Any, ax: Any = None) -> Any:
    """Draws the plan view of chaser and target, with their truth dashed in the same colours. `result` may be a
    Trajectory, too.

    >>> import tandem
    >>> lines = tandem.plot.trajectories(tandem.estimate("docking_a", max_keyframes=20)).lines
    >>> len(lines)
    4
    """
    if isinstance(result, Trajectory):
        known = {result.name: result}
    elif isinstance(result, Results) and "rendezvous.csv" in result.files:
        known = _rendezvous_trajectories(result)
    else:
        known = {name: _part(result, name) for name in ("chaser", "target")}
        known = {name: trajectory for name, trajectory in known.items() if trajectory is not None}
    if not known:
        raise BadInputError(f"plot.trajectories: {_described(result)} has no trajectories")
    ax = _axes(ax)
    for (name, trajectory), colour in zip(known.items(), (_BLUE, _ORANGE)):
        ax.plot(*trajectory.positions[:, :2].T, color=colour, label=name)
        truth = _part(result, name + "_truth")
        if truth is not None:
            ax.plot(*truth.positions[:, :2].T, color=colour, linestyle="--", linewidth=0.8, label=f"{name}, truth")
    return _as_plan_view(ax)


def errors(result: Any, columns: Sequence[str] = ("x_m", "y_m", "rz_deg"), ax: Any = None) -> Any:
    """Draws errors over time in their 3σ bands. There is no band where nothing is estimated. Needs truth.

    >>> import tandem
    >>> len(tandem.plot.errors(tandem.estimate("docking_a", max_keyframes=20), ["x_m", "y_m"]))
    2
    """
    table: Optional[Dict[str, np.ndarray]] = _part(result, "errors")
    if not table:
        raise BadInputError(f"plot.errors: {_described(result)} has no errors, which need an estimate with truth")
    for column in columns:
        if "error_" + column not in table:
            known = ", ".join(k[len("error_"):] for k in table if k.startswith("error_"))
            raise BadInputError(f"plot.errors: there is no column {column}; there are {known}")
    axes = np.atleast_1d(_axes(ax, len(columns), 1.2 * len(columns)))
    for a, column in zip(axes, columns):
        error = table["error_" + column]
        sigma = table.get("three_sigma_" + column)
        if sigma is not None:
            known = np.isfinite(sigma)
            a.fill_between(table["t"], np.where(known, -sigma, np.nan), np.where(known, sigma, np.nan), color=_BLUE,
                           alpha=0.2, linewidth=0, label="3σ")
        a.plot(table["t"], error, color=_BLUE, linewidth=0.6)
        name, _, unit = column.rpartition("_")
        a.set_ylabel(f"{name} [{unit}]", fontsize=8)
        scale = np.nanpercentile(np.abs(error), 99) if np.isfinite(error).any() else 1.0
        a.set_ylim(-3 * scale - 1e-12, 3 * scale + 1e-12)
    axes[-1].set_xlabel("time [s]", fontsize=8)
    return axes


def residuals(fit: Any, ax: Any = None) -> Any:
    """Draws mean and standard deviation of the standardised residuals of each component; 0 and 1 are expected. `fit` is
    a result or its fit report.

    >>> import tandem
    >>> tandem.plot.residuals(tandem.estimate("docking_a", max_keyframes=20)).get_ylabel()
    'standardised residual'
    """
    report = fit if isinstance(fit, FitReport) else _part(fit, "fit")
    if report is None:
        raise BadInputError(f"plot.residuals: {_described(fit)} has no fit report; give an estimate")
    ax = _axes(ax)
    names, means, sigmas = [], [], []
    for sensor, entry in report["sensors"].items():
        for component, values in entry["components"].items():
            if values.get("sigma") is None:
                continue
            names.append(f"{sensor} {component}")
            means.append(values["mean"])
            sigmas.append(values["sigma"])
    at = np.arange(len(names))
    ax.axhspan(-1, 1, color=_GREY, alpha=0.15, linewidth=0)
    ax.errorbar(at, means, yerr=sigmas, fmt="o", color=_BLUE, markersize=3, capsize=2, linewidth=0.8)
    ax.set_xticks(at)
    ax.set_xticklabels(names, rotation=60, ha="right", fontsize=8)
    ax.set_ylabel("standardised residual", fontsize=8)
    return ax


def consistency(result: Any, ax: Any = None) -> Any:
    """Draws the normalised estimation error squared (NEES) of the target's position, with its 95 % range.

    >>> import tandem
    >>> tandem.plot.consistency(tandem.estimate("docking_a", max_keyframes=20)).get_ylabel()
    'NEES of the position'
    """
    target, truth = _part(result, "target"), _part(result, "target_truth")
    if target is None or truth is None or target.covariances is None:
        raise BadInputError(f"plot.consistency: {_described(result)} has no truth or no covariances; give an estimate "
                            "with truth")
    ax = _axes(ax)
    inside = (target.t >= truth.t[0]) & (target.t <= truth.t[-1])
    t = target.t[inside]
    difference = truth.at(t).positions - target.positions[inside]
    known = target.has_orientation[inside]
    rotation = np.where(known[:, None, None], target.poses[inside][:, :3, :3], np.eye(3))
    local = np.einsum("nji,nj->ni", rotation, difference)
    covariance = target.covariances[inside][:, :3, :3]
    nees = np.einsum("ni,ni->n", local, np.linalg.solve(covariance, local[:, :, None])[:, :, 0])
    ax.semilogy(t, np.maximum(nees, 1e-3), ".", color=_BLUE, markersize=1.5)
    ax.axhspan(0.216, 9.348, color=_GREY, alpha=0.2, linewidth=0, label="95 % of χ²(3)")
    ax.set_xlabel("time [s]", fontsize=8)
    ax.set_ylabel("NEES of the position", fontsize=8)
    ax.legend(fontsize=8, frameon=False)
    return ax


def coverage(result: Any, ax: Any = None) -> Any:
    """Draws when each sensor measured the target: one strip for each sensor.

    >>> import tandem
    >>> tandem.plot.coverage(tandem.estimate("docking_a", max_keyframes=20)).get_xlabel()
    'time [s]'
    """
    if not isinstance(result, Results) or "target_fixes.csv" not in result.files:
        raise BadInputError(f"plot.coverage: {_described(result)} has no measurements; give an estimate")
    ax = _axes(ax, height=1.4)
    table = result.table("target_fixes")
    names = list(dict.fromkeys(table["sensor"]))
    for row, name in enumerate(names):
        t = table["t"][table["sensor"] == name]
        ax.plot(t, np.full(len(t), row), "|", color=(_BLUE, _ORANGE, _GREEN)[row % 3], markersize=8)
    ax.set_yticks(range(len(names)))
    ax.set_yticklabels(names, fontsize=8)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.set_xlabel("time [s]", fontsize=8)
    return ax


def sparsity(problem: Any, ax: Any = None) -> Any:
    """Draws which variables occur together in a block: the sparsity of the Hessian.

    >>> import tandem
    >>> p = tandem.Problem()
    >>> block = p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, p.add(tandem.R1([0.0])))
    >>> len(tandem.plot.sparsity(p).lines)
    1
    """
    if not hasattr(problem, "_block_variables"):
        raise BadInputError(f"plot.sparsity: expected a Problem, not {_described(problem)}")
    ax = _axes(ax, height=3.2)
    pairs = {(a, b) for block in problem._block_variables() for a in block for b in block}
    if pairs:
        size = max(0.5, 100 / (1 + max(p[0] for p in pairs)))
        ax.plot(*np.array(sorted(pairs)).T, "s", color=_BLUE, markersize=size)
    ax.set_aspect("equal")
    ax.invert_yaxis()
    ax.set_xlabel("variable", fontsize=8)
    ax.set_ylabel("variable", fontsize=8)
    return ax


def plan(result: Any, ax: Any = None) -> Any:
    """Draws the plan view of a planned chaser and the predicted target.

    >>> import tandem
    >>> len(tandem.plot.plan(tandem.plan("docking_a", at=600, horizon=10, step=0.5)).lines)
    3
    """
    if not isinstance(result, Plan):
        raise BadInputError(f"plot.plan: expected a plan, not {_described(result)}")
    ax = _axes(ax)
    ax.plot(*result.chaser.positions[:, :2].T, color=_BLUE, label="planned chaser")
    ax.plot(*result.target.positions[:, :2].T, color=_ORANGE, label="predicted target")
    ax.plot(*result.chaser.positions[0, :2], "o", color=_BLUE, markersize=4)
    return _as_plan_view(ax)


def save(ax: Any, path: PathLike, dpi: int = 300) -> None:
    """Writes the figure of `ax` to a file, in the size of the figure: 3.5 in wide unless you have drawn on your own.

    >>> import tandem
    >>> import os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = os.path.join(folder, "problem.png")
    ...     tandem.plot.save(tandem.plot.sparsity(tandem.Problem()), file)
    ...     os.path.getsize(file) > 1000
    True
    """
    first = np.atleast_1d(ax)[0]
    first.figure.savefig(path, dpi=dpi)  # cropping would change the width and thereby the font size on the page
