"""Vectors of any supported length."""

from typing import Any

import numpy as np

from . import _core
from .errors import BadInputError

_CLASSES = {n: getattr(_core, f"R{n}") for n in range(1, 13) if hasattr(_core, f"R{n}")}


def Rn(vector: Any) -> Any:
    """Returns a vector as an element of R1 … R12, by its last dimension.

    >>> import tandem
    >>> tandem.Rn([1.0, 2.0])
    R2(1, 2)
    """
    array = np.asarray(vector)
    n = array.shape[-1] if array.ndim else 1
    if n not in _CLASSES:
        raise BadInputError(f"Rn: vectors have {', '.join(map(str, _CLASSES))} entries, not {n}")
    return _CLASSES[n](array if array.ndim else array.reshape(1))
