"""Messages for calls of the compiled module whose arguments have a wrong number or type."""

import functools
import re
from types import ModuleType
from typing import Any, List

# Special methods that users call with arguments. Operators are not wrapped: they must return NotImplemented.
_SPECIAL = ("__init__", "__call__")


def _signatures(name: str, doc: str) -> List[str]:
    """Returns the calls that a docstring of pybind11 lists, without types and self."""
    result = []
    for line in doc.splitlines():
        match = re.match(r"(?:\d+\. )?(\w+)\((.*)\)( -> .*)?$", line.strip())
        if not match or match.group(1) not in (name, "__init__") or "*args, **kwargs" in match.group(2):
            continue
        arguments = []
        depth = 0
        part = ""
        for char in match.group(2) + ",":
            depth += (char in "([{") - (char in ")]}")
            if char == "," and depth == 0:
                arguments.append(part.strip())
                part = ""
            else:
                part += char
        plain = [re.sub(r":[^=]*?(?= = |$)", "", a).replace(" = ", "=") for a in arguments if not a.startswith("self")]
        text = re.sub(r"\*\*\w+", "option=value, ...", ", ".join(p for p in plain if p))
        if text not in result and "arg0" not in text:
            result.append(text)
    return result


def _readable(function: Any, name: str, doc: str, skipped: int) -> Any:
    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except BaseException as error:
            args = args[skipped:]  # tools that show this frame must not touch an object that is not constructed
            text = str(error) if isinstance(error, (TypeError, RuntimeError)) else ""
            if "incompatible" not in text.partition("\n")[0] and not text.startswith("Unable to cast"):
                raise
        given = [type(a).__name__ for a in args] + [f"{k}={type(v).__name__}" for k, v in kwargs.items()]
        known = " or ".join(f"{name}({s})" for s in _signatures(name, doc)) or f"other arguments of {name}"
        raise TypeError(f"{name}: expected {known}, not ({', '.join(given)})") from None
    return call


def make_readable(module: ModuleType) -> None:
    """Replaces the functions and methods of a module by ones whose errors are one sentence."""
    for name, thing in list(vars(module).items()):
        if isinstance(thing, type):
            for key, member in list(vars(thing).items()):
                if key.startswith("__") and key not in _SPECIAL:
                    continue
                function = member.__func__ if isinstance(member, staticmethod) else member
                if not callable(function) or isinstance(function, type):
                    continue
                doc = function.__doc__ or ""
                static = isinstance(member, staticmethod)
                shown = name if key == "__init__" else key
                wrapped = _readable(function, shown, doc, 0 if static else 1)
                setattr(thing, key, staticmethod(wrapped) if static else wrapped)
        elif callable(thing) and not name.startswith("_"):
            setattr(module, name, _readable(thing, name, thing.__doc__ or "", 0))
