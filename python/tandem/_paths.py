"""Paths and temporary folders."""

import os
import pathlib
import shutil
import tempfile
import weakref
from typing import Union

PathLike = Union[str, "os.PathLike[str]"]


class TemporaryFolder:
    """Folder that exists as long as this object. Copies of the object in forked processes do not remove it."""

    def __init__(self) -> None:
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="tandem-"))
        weakref.finalize(self, _remove, self.path, os.getpid())


def _remove(path: pathlib.Path, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(path, ignore_errors=True)
