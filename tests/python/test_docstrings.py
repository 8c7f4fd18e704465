"""Docstrings: every public function, class and method has an example, and all examples run."""

import doctest
import importlib
import inspect
import pkgutil
import re

import pytest

import tandem
from tandem import _core

PARSER = doctest.DocTestParser()
RULES = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def modules():
    names = [m.name for m in pkgutil.iter_modules(tandem.__path__) if m.name != "_core"]
    return [tandem] + [importlib.import_module("tandem." + name) for name in names]


def members(kind):
    """Yields the public functions that a class has from the package, with their names."""
    for key in dir(kind):
        owner = next((c for c in kind.__mro__ if key in vars(c)), object)
        if not key.startswith("_") and owner.__module__.startswith("tandem") and callable(getattr(kind, key)):
            yield key, getattr(kind, key)


def public():
    """Yields (path, object, class) of all public functions, classes and methods; the class is that of a method."""
    for module in (tandem, tandem.plot, tandem.testing):
        names = tandem.__all__ if module is tandem else [n for n in vars(module) if not n.startswith("_")]
        for name in names:
            thing = getattr(module, name)
            if inspect.ismodule(thing) or not callable(thing):
                continue
            if module is not tandem and thing.__module__ != module.__name__:
                continue  # imported
            path = name if module is tandem else f"{module.__name__}.{name}"
            yield path, thing, None
            if isinstance(thing, type):
                for key, member in members(thing):
                    yield f"{path}.{key}", member, thing


def examples(thing):
    """Returns the code of the examples in a docstring, and the exceptions that they raise."""
    found = PARSER.get_examples(getattr(thing, "__doc__", None) or "")
    return " ".join(example.source + (example.exc_msg or "") for example in found)


def has_example(path, thing, kind):
    """Whether the name occurs in an example of the object, or of the class of a method."""
    name = re.compile(rf"\b{path.rpartition('.')[2]}\b")
    if isinstance(thing, type) and name.search(examples(thing.__init__)):
        return True
    return bool(name.search(examples(thing)) or (kind and name.search(examples(kind))))


def test_every_public_name_has_an_example():
    everything = list(public())
    assert len(everything) > 300
    missing = [path for path, thing, kind in everything if not has_example(path, thing, kind)]
    assert not missing, f"{len(missing)} without an example: {' '.join(missing)}"


@pytest.mark.parametrize("module", modules(), ids=lambda m: m.__name__)
def test_examples_in_docstrings(module):
    optional = {"tandem.plot": "matplotlib", "tandem.trajectory": "pandas"}
    if module.__name__ in optional:
        pytest.importorskip(optional[module.__name__])
    failures, _ = doctest.testmod(module, extraglobs={}, optionflags=RULES)
    assert failures == 0


def test_examples_of_the_compiled_module():
    runner = doctest.DocTestRunner(optionflags=RULES)
    documented = dict(vars(_core))
    for name, kind in vars(_core).items():
        if isinstance(kind, type):
            documented.update((f"{name}.{key}", member) for key, member in members(kind))
    for name, thing in documented.items():
        runner.run(PARSER.get_doctest(getattr(thing, "__doc__", None) or "", {}, name, None, 0))
    assert runner.tries > 800 and runner.failures == 0
