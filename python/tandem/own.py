"""Residuals of your own."""

import ctypes
import importlib
import operator
import types
from typing import Any, Callable, Optional, Sequence

import numpy as np

from ._core import Problem, PythonResidual, Variable, _twist_components, between
from .errors import BadInputError
from .vectors import Rn

_FunctionPointer: Any = ctypes.CFUNCTYPE(None).__base__  # base class of all function pointers of ctypes

_JACOBIANS = ("given", "complex", "difference")


def residual(function: Optional[Callable[..., Any]] = None, *, dim: int, jacobian: str = "difference",
             batched: bool = False, data: Sequence[Any] = (), name: Optional[str] = None) -> Any:
    """Makes a residual of a Python function, for Problem.minimize and subject_to. Also a decorator.

    The function gets the states that the block reads, one argument each: arrays of shape (n,) for vectors (R1, …),
    group elements such as SE3 otherwise. It returns the rows, shape (dim,). The residual can be called with states too.

    Args:
        function: the function, or an object that can be called.
        dim: number of rows.
        jacobian: "difference": central differences of right perturbations, step 1e-6. "complex": complex steps, exact
            to rounding, only for vectors and functions that keep the imaginary part; np.linalg.norm, abs, max and
            float do not, which the first evaluations detect by differences. "given": the function accepts
            `jacobians: bool` and returns rows, or (rows, [Jacobian of each state, shape (dim, dof)]).
        batched: one call evaluates all blocks. States and rows then have one more axis in front: (n, dof), (n, dim),
            and Jacobians (n, dim, dof); group elements are arrays.
        data: arrays with one row for each block, for batched functions, which get them after the states. They are
            copied.
        name: name in messages.

    Raise UndefinedResidualError where the residual is undefined; the solver then shortens the step. NaN has the same
    effect. Another exception ends the solve and is the cause of a ResidualError. Functions are called by one thread at
    a time, and hold the interpreter's lock. A problem keeps its functions alive. If the function is a method of the
    object that holds the problem, Python's garbage collector frees both, unless the residual itself is stored too.

    >>> import tandem
    >>> @tandem.residual(dim=1, jacobian="complex")
    ... def circle(x):
    ...     return x[0] ** 2 + x[1] ** 2
    >>> p = tandem.Problem()
    >>> x = p.add(tandem.R2([1.0, 0.5]), "x")
    >>> a = p.minimize(tandem.Prior(tandem.R2([2.0, 0.0])), 1.0, x)
    >>> b = p.subject_to(circle, tandem.equal_to(1.0), x)
    >>> p.solve().status, p.value(x).vector.round(6)
    ('converged', array([1., 0.]))
    """
    if function is None:
        return lambda f: residual(f, dim=dim, jacobian=jacobian, batched=batched, data=data, name=name)
    if not callable(function):
        raise BadInputError(f"residual: expected a function, not {type(function).__name__}")
    if jacobian not in _JACOBIANS:
        raise BadInputError(f"residual: jacobian is one of {', '.join(_JACOBIANS)}, not {jacobian!r}")
    if not isinstance(dim, (int, np.integer)) or dim < 1:
        raise BadInputError(f"residual: dim is a positive number of rows, not {dim!r}")
    arrays = tuple(_constant(d) for d in (data if isinstance(data, (tuple, list)) else (data,)))
    if arrays and not batched:
        raise BadInputError("residual: data need batched=True; without it, use a closure for each block")
    counts = {len(a) if a.ndim else 0 for a in arrays}
    if len(counts) > 1 or 0 in counts:
        raise BadInputError("residual: the arrays of data must have one row for each block")
    own_name = name or str(getattr(function, "__name__", type(function).__name__))
    return PythonResidual(function=function, pointer=0, name=own_name, dim=int(dim),
                          jacobian=jacobian, batched=bool(batched), data=arrays,
                          count=counts.pop() if counts else 1, numbers=np.empty(0), owner=function)


def _reference(name: str, function: Any) -> Any:
    """Returns what a pickle stores of the function of a residual: (module, qualified name), or a callable object."""
    if function is None:
        raise BadInputError(f"{name}: a compiled residual cannot be pickled, because its address is valid in this "
                            "process only; build the problem again")
    if not isinstance(function, types.FunctionType):
        return function
    reference = (function.__module__, function.__qualname__)
    try:
        found = _function(reference)
    except (AttributeError, ImportError):
        found = None
    if found is not function:
        raise BadInputError(f"{name}: the residual cannot be pickled, because its function is not importable as "
                            f"{'.'.join(reference)}; define it at the top level of a module")
    return reference


def _function(reference: Any) -> Any:
    """Returns the function of a reference. A residual by this name, made by the decorator, stands for its function."""
    if not isinstance(reference, tuple):
        return reference
    module, qualname = reference
    found = operator.attrgetter(qualname)(importlib.import_module(module))
    return found.function if isinstance(found, PythonResidual) else found


def _constant(data: Any) -> np.ndarray:
    """Returns a copy that cannot be changed, because copies of a problem share it."""
    array = np.array(data)
    if array.dtype.kind in "fc" and not np.isfinite(array).all():
        raise BadInputError("residual: the data contain NaN or infinity")
    array.flags.writeable = False
    return array


def _call(self: Any, *states: Any, jacobians: bool = False) -> Any:
    """Returns the rows at these states, shape (dim,) or (n, dim), and with `jacobians` also a list of the Jacobians by
    right perturbations of each state. States are group elements, or arrays of vectors."""
    p = Problem()
    x = [p.add(s if hasattr(s, "dof") else Rn(s)) for s in states]
    blocks = p.subject_to(self, between(-np.inf, np.inf), x)
    single = len(blocks) == 1 and all(isinstance(v, Variable) for v in x)
    parts = [p.linearization(blocks[i]) for i in range(len(blocks))]
    rows = np.array([r for r, _ in parts]).reshape(len(parts), self.dim)
    if not jacobians:
        return rows[0] if single else rows
    ends = np.cumsum([p.value(v).dof for v in x])[:-1]
    J = np.array([j for _, j in parts])
    return (rows[0] if single else rows), list(np.split(J[0] if single else J, ends, axis=-1))


setattr(PythonResidual, "__call__", _call)


def compiled_residual(function: Any, *, dim: int, data: Any = None, name: Optional[str] = None) -> Any:
    """Makes a residual of a compiled function: a numba cfunc, a ctypes function pointer, or an address.

    The function is int f(const double* data, const double* x, double* r, double* J, int jacobians). `data` is a row of
    the array `data`. `x` has the plain numbers of all states one after the other (the property `parameters` of the
    groups). The function sets the rows r and, if `jacobians` is not 0, the Jacobians by right perturbations of all
    states side by side, row by row: dim × (sum of the dofs); J is zero before. It returns 0, or another number where it is
    undefined. Solvers call it from several threads at once, without the interpreter's lock.

    Args:
        function: the compiled function.
        dim: number of rows.
        data: array of shape (n, k) with one row for each block, or (k,) for all blocks.
        name: name in messages.

    >>> import ctypes, numpy as np, tandem
    >>> @ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.POINTER(ctypes.c_double)] * 4, ctypes.c_int)
    ... def scaled(data, x, r, J, jacobians):       # in earnest, a function that numba or a C compiler has compiled
    ...     r[0] = data[0] * x[0]
    ...     if jacobians:
    ...         J[0] = data[0]
    ...     return 0
    >>> tandem.compiled_residual(scaled, dim=1, data=[3.0])(tandem.R1([2.0]))
    array([6.])
    """
    address = getattr(function, "address", function)  # of a numba cfunc
    if isinstance(function, (_FunctionPointer, ctypes.c_void_p)):
        address = ctypes.cast(function, ctypes.c_void_p).value
    if not isinstance(address, (int, np.integer)) or isinstance(address, bool) or address <= 0:
        raise BadInputError("compiled_residual: expected a numba cfunc, a ctypes function pointer or an address, not "
                            f"{type(function).__name__}")
    if not isinstance(dim, (int, np.integer)) or dim < 1:
        raise BadInputError(f"compiled_residual: dim is a positive number of rows, not {dim!r}")
    rows = np.empty((1, 0)) if data is None else np.ascontiguousarray(data, dtype=float)
    if rows.ndim not in (1, 2) or np.isnan(rows).any():
        raise BadInputError(f"compiled_residual: data have shape (k,) or (n, k) and no NaN, not {rows.shape}")
    if data is not None and rows.size == 0:
        raise BadInputError(f"compiled_residual: the data are empty, of shape {rows.shape}; without data, leave `data` out")
    rows = np.atleast_2d(rows)
    own_name = name or str(getattr(function, "__name__", "compiled"))
    return PythonResidual(function=None, pointer=int(address), name=own_name, dim=int(dim),
                          jacobian="given", batched=False, data=(), count=len(rows),
                          numbers=rows.ravel(), owner=(function, rows))


def TwistComponents(dt: Any, axes: str) -> Any:
    """Components of the twist between two poses [m/s, rad/s].

    Args:
        dt: time between the poses [s].
        axes: names separated by spaces, from surge, sway, heave, roll_rate, pitch_rate, yaw_rate. "sway heave" equal to
            0 is the non-holonomic constraint of a vehicle that moves along its axis.

    >>> import tandem
    >>> tandem.TwistComponents(2.0, "surge sway heave")(tandem.SE3(), tandem.SE3.exp([3, 1, 0, 0, 0, 0]))
    array([1.5, 0.5, 0. ])
    """
    order = ("surge", "sway", "heave", "roll_rate", "pitch_rate", "yaw_rate")
    if not isinstance(axes, str):
        raise BadInputError(f"TwistComponents: the axes are a text of {', '.join(order)}, not {axes!r}")
    words = axes.split()
    for word in words:
        if word not in order:
            raise BadInputError(f"TwistComponents: the axes are {', '.join(order)}, not {word!r}")
    key = tuple(a for a in order if a in words)
    if key not in _twist_components:
        known = "; ".join(" ".join(k) for k in _twist_components)
        raise BadInputError(f"TwistComponents: the axes {axes!r} are not available together; use {known}")
    return _twist_components[key](dt)
