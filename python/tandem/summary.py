"""Summaries of runs, and fit reports."""

import html
import json
from typing import Any, Dict, Iterator, List, Mapping

from . import _html
from ._core import Problem, _fit_report


class Summary(Mapping[str, Any]):
    """Summary of a run: the JSON document of the command, with its keys also as attributes.

    >>> import tandem
    >>> summary = tandem.Summary({"cost": 2.5, "fit": {"consistent": True}})
    >>> summary.cost, summary["cost"], summary.fit.consistent
    (2.5, 2.5, True)
    >>> summary.to_dict()["fit"]
    {'consistent': True}
    """

    def __init__(self, values: Dict[str, Any], name: str = "summary") -> None:
        if not isinstance(values, dict):
            raise TypeError(f"{name}: expected a dictionary, not {type(values).__name__}")
        self._values = values
        self._name = name

    def __getitem__(self, key: str) -> Any:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        try:
            value = self._values[key]
        except KeyError:
            raise AttributeError(f"the {self._name} has no entry {key}; it has {', '.join(self._values)}") from None
        return Summary(value, key) if isinstance(value, dict) else value

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self._values]

    def to_dict(self) -> Dict[str, Any]:
        """Returns the JSON document as dictionaries."""
        return self._values

    def _scalars(self) -> List[Any]:
        return [(k, v) for k, v in self._values.items() if not isinstance(v, (dict, list)) and k != "schema"]

    def __repr__(self) -> str:
        text = ", ".join(f"{k}={v!r}" for k, v in self._scalars())
        return f"<{self._name}: {text[:160]}{'…' if len(text) > 160 else ''}>"

    def _repr_html_(self) -> str:
        return _html.table(self._scalars())


class FitReport(Summary):
    """Agreement of a solution with its data and the stated noise.

    >>> import tandem
    >>> fit = tandem.estimate("docking_a", max_keyframes=60).fit
    >>> isinstance(fit, tandem.FitReport), fit.consistent == fit.to_dict()["consistent"]
    (True, True)
    """

    def __init__(self, values: Dict[str, Any]) -> None:
        if isinstance(values, Problem):
            raise TypeError("FitReport: expected a dictionary, not Problem; use tandem.fit_report")
        super().__init__(values, "fit report")

    @property
    def consistent(self) -> bool:
        """Whether the data fit the model."""
        return bool(self["consistent"])

    @property
    def verdict(self) -> str:
        """The verdict in one sentence."""
        return str(self["verdict"])

    def __repr__(self) -> str:
        return f"<FitReport: {self.verdict}>"

    def _repr_html_(self) -> str:
        rows = []
        for sensor, fit in self["sensors"].items():
            for component, c in fit.get("components", {}).items():
                rows.append((sensor, fit["used"], component, *(f"{c[k]:.2f}" if c.get(k) is not None else "–"
                                                               for k in ("mean", "sigma", "correlation"))))
        return f"<p>{html.escape(self.verdict)}</p>" + _html.table(
            rows, ("sensor", "used", "component", "mean", "σ", "lag-1 correlation"))


def fit_report(problem: Problem, sensors: Dict[str, Any]) -> FitReport:
    """Judges whether the costs of a solved problem agree with their stated noise.

    Args:
        problem: a problem at its solution.
        sensors: blocks of costs by name, as Problem.minimize returns them. Their rows are the components "row 0",
            "row 1", …; the order of the blocks counts as the order in time.

    >>> import numpy as np, tandem
    >>> p = tandem.Problem()
    >>> x = p.add(tandem.R1([0.0]), "x")
    >>> z = np.random.default_rng(1).normal(size=(100, 1))
    >>> blocks = p.minimize(tandem.Prior(tandem.R1(z)), 0.1, x)
    >>> summary = p.solve()
    >>> report = tandem.fit_report(p, {"scale": blocks})
    >>> report.consistent, report["sensors"]["scale"]["used"]
    (False, 100)
    >>> p.set_noise(blocks, 1.0)
    >>> tandem.fit_report(p, {"scale": blocks}).consistent
    True
    """
    if not isinstance(problem, Problem) or not isinstance(sensors, Mapping):
        raise TypeError("fit_report: expected a Problem and a dictionary {name: blocks}, not "
                        f"({type(problem).__name__}, {type(sensors).__name__})")
    return FitReport({"sensors": {}, **json.loads(_fit_report(problem, dict(sensors)))})
