"""Paths and temporary folders."""

import os
import pathlib
import tempfile
from typing import Union

PathLike = Union[str, "os.PathLike[str]"]


class TemporaryFolder:
    """Folder that exists as long as this object."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="tandem-")
        self.path = pathlib.Path(self._folder.name)
