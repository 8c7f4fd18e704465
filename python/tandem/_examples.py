"""Examples of the compiled functions, which are appended to their docstrings. The tests run them."""

import re
from types import ModuleType
from typing import Any, Iterable, Iterator, Tuple

from ._example_texts import TEXTS, VALUES

# Weight of a residual of three standard deviations.
_LOSS_WEIGHTS = {"Huber(1.0)": 0.333, "Cauchy(1.0)": 0.1, "GemanMcClure(1.0)": 0.01, "Tukey(2.0)": 0.0,
                 "StudentT(3.0, 1)": 0.308}
_LOSS = """
>>> p = tandem.Problem()
>>> x = p.add(tandem.R1([3.0]))
>>> block = p.minimize(tandem.Prior(tandem.R1([0.0])), 1.0, x, loss=tandem.{loss})
>>> round(p.weight(block), 3)
{weight}
"""

# Methods of each group {G} with {n} degrees of freedom, which acts on points of {k} coordinates.
_START = """
>>> X, Y = {G}.exp(np.full({n}, 0.1)), {G}.exp(np.full({n}, 0.4))
>>> v, d = np.full({n}, 0.2), np.full({n}, 1e-6)
"""
_GROUP = {
    "identity": ">>> len({G}.identity(3))\n3",
    "exp": ">>> {G}.exp(np.zeros((100, {n}))).log().shape\n(100, {n})",
    "log": ">>> np.allclose({G}.exp(v).log(), v)\nTrue",
    "adjoint": ">>> np.allclose((X @ {G}.exp(v) @ X.inverse()).log(), X.adjoint() @ v)\nTrue",
    "inverse": ">>> np.allclose((X @ X.inverse()).log(), 0)\nTrue",
    "matrix": ">>> np.allclose((X @ Y).matrix(), X.matrix() @ Y.matrix())\nTrue",
    "act": ">>> p = np.ones({k})\n>>> np.allclose((X @ Y).act(p), X.act(Y.act(p)))\nTrue",
    "jr": ">>> np.allclose({G}.exp(v + d).log(), ({G}.exp(v) @ {G}.exp({G}.jr(v) @ d)).log(), atol=1e-11)\nTrue",
    "jl": ">>> np.allclose({G}.exp(v + d).log(), ({G}.exp({G}.jl(v) @ d) @ {G}.exp(v)).log(), atol=1e-11)\nTrue",
    "jr_inv": ">>> np.allclose({G}.jr_inv(v) @ {G}.jr(v), np.eye({n}))\nTrue",
    "jl_inv": ">>> np.allclose({G}.jl_inv(v) @ {G}.jl(v), np.eye({n}))\nTrue",
    "plus": ">>> np.allclose(X.plus(v).log(), (X @ {G}.exp(v)).log())\nTrue",
    "minus": ">>> np.allclose(X.plus(Y.minus(X)).log(), Y.log())\nTrue",
    "interpolate": ">>> np.allclose(X.interpolate(Y, 0.5).log(), X.plus(0.5 * Y.minus(X)).log())\nTrue",
    "stack": ">>> len({G}.stack([X, {G}.identity(2)]))\n3",
}
_VECTOR = """
>>> x = {G}(np.arange({n}.0))
>>> print((x @ x).vector)
{twice}
"""

def _with_imports(example: str, names: Iterable[str] = ()) -> str:
    """Returns the example with the imports that it needs."""
    modules = [text for text, used in (("numpy as np", "np."), ("tandem", "tandem.")) if used in example]
    lines = [">>> import " + ", ".join(modules)] if modules else []
    if names:
        lines.append(f">>> from tandem import {', '.join(sorted(names))}")
    return "\n".join([*lines, example.strip()]) + "\n"


def _examples(module: ModuleType) -> Iterator[Tuple[str, str]]:
    """Yields the path of a function or class in the module, and its example."""
    for line in VALUES.strip().splitlines():
        expression, _, value = line.partition(" -> ")
        name = expression.partition("(")[0]
        names = {word for word in re.findall(r"\w+", expression) if word in vars(module)}
        yield name, _with_imports(f">>> print({expression})\n{value}", names)
    for loss, weight in _LOSS_WEIGHTS.items():
        yield loss.partition("(")[0], _with_imports(_LOSS.format(loss=loss, weight=weight))
    for name, kind in vars(module).items():
        if hasattr(kind, "jr") and not name.startswith("Bundle"):
            values = {"G": "tandem." + name, "n": kind.dof, "k": 2 if name in ("SO2", "SE2") else 3}
            if name.startswith("R"):
                twice = " ".join(f"{2 * i:{1 if kind.dof <= 5 else 2}}." for i in range(kind.dof))
                values.update(k=kind.dof, twice=f"[{twice}]")
                yield name, _with_imports(_VECTOR.format(**values))
            for method, example in _GROUP.items():
                start = [line for line in _START.strip().splitlines() if re.search(r"\b[XYvd]\b", example)]
                yield f"{name}.{method}", _with_imports("\n".join([*start, example]).format(**values))
    for part in TEXTS.strip().split("\n+"):
        paths, _, example = part.strip().partition("\n")
        for path in paths.split():
            yield path, _with_imports(example)


def append_examples(module: ModuleType) -> None:
    """Appends the examples to the docstrings of the module."""
    for path, example in _examples(module):
        thing: Any = module
        for name in path.split("."):
            thing = getattr(thing, name)
        thing.__doc__ = (thing.__doc__ or "").rstrip() + "\n\n" + example
