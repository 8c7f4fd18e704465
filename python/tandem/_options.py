"""Conversion of keyword arguments to the options of a command."""

import os
from typing import Any, Dict, List, Mapping, Sequence, Union

import numpy as np

from ._paths import PathLike
from .errors import BadInputError
from .results import Results

# A value of an option: a text, a number, a sequence of numbers, or a dictionary of them for NAME=value options.
OptionValue = Union[None, PathLike, float, Sequence[Any], Mapping[str, Any], np.ndarray]

_declared: Dict[str, Dict[str, Sequence[Any]]] = {}


def declare(commands: Dict[str, Dict[str, Sequence[Any]]]) -> None:
    """Records the options of the commands: placeholder and whether an option may be repeated."""
    _declared.update(commands)


def has_option(command: str, option: str) -> bool:
    """Returns whether a command has an option; its name has hyphens."""
    return option in _declared[command]


def _text(option: str, value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, (bool, np.bool_)) or value is None:
        raise BadInputError(f"{option}: {value} is not a value of this option")
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (Sequence, np.ndarray)):
        return ",".join(_text(option, v) for v in value)
    raise BadInputError(f"{option}: a {type(value).__name__} is not a value of this option")


def _file_of(option: str, result: Results) -> str:
    """Returns the file of a result that an option reads."""
    file = {"noise-from": "noise.yaml", "config": "run.yaml"}.get(option)
    if file is None or file not in result.files:
        raise BadInputError(f"{option.replace('-', '_')}: a result of {result.command} is not a value of this option")
    return file


def words(command: str, options: Mapping[str, Any]) -> List[str]:
    """Returns the words of the command line for these options. None and False leave an option out."""
    result = []
    for name, value in options.items():
        takes, repeatable = _declared[command][name]
        if value is None or value is False:
            continue
        if not takes:
            if value is not True:
                raise BadInputError(f"{name}: is either True or False, not {value!r}")
            result.append("--" + name)
            continue
        if isinstance(value, Mapping):
            if not repeatable:
                raise BadInputError(f"{name}: takes {takes}, not a dictionary")
            values = [f"{key}={_text(name, v)}" for key, v in value.items()]
        elif isinstance(value, Results):
            values = [os.fspath(value.folder() / _file_of(name, value))]
        elif repeatable and isinstance(value, (list, tuple)) and all(isinstance(v, (str, os.PathLike)) for v in value):
            values = [os.fspath(v) for v in value]
        else:
            try:
                values = [_text(name, value)]
            except BadInputError as error:
                raise BadInputError(f"{error}; it takes {takes}") from None
        result += [f"--{name}={v}" for v in values]
    return result
