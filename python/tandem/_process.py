"""Runs a command of Tandem and builds its result from the files that it writes.

Runs use the programs of the command line. Their numbers are thus the same, memory returns to the system after each run,
and a crash or an interrupt leaves the interpreter intact.
"""

import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import warnings
from typing import IO, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from . import _build
from ._options import has_option, words
from ._paths import PathLike, TemporaryFolder
from .errors import BadInputError, Error, IncompleteWarning, MisfitError
from .results import Results
from .scenario import Scenario, ScenarioFolder

ScenarioLike = Union[PathLike, Scenario]
ResultLike = Union[PathLike, Scenario, Results]

_SUCCESS, _INVALID, _INCOMPLETE, _MISFIT = 0, 1, 2, 3


def program(command: str) -> str:
    """Returns the path of the program of a command."""
    folder = pathlib.Path(__file__).parent / _build.COMMANDS_FROM_PACKAGE
    path = folder / f"tandem-{command}"
    if not path.exists():
        # In a build folder, the package consists of links. This file may then be in the source folder, without
        # commands.
        path = pathlib.Path(_build.__file__).parent / _build.COMMANDS_FROM_PACKAGE / f"tandem-{command}"
    if not path.exists():
        raise Error(f"the program {path} is missing; build or install the command line of Tandem")
    return os.path.realpath(path)


def last_message(errors: str) -> str:
    """Returns the last line of a program's standard error, without the prefix "tandem: "."""
    lines = [line for line in errors.strip().splitlines() if line]
    last = lines[-1] if lines else "no message"
    return last[len("tandem: "):] if last.startswith("tandem: ") else last


class _Progress:
    """Progress of a run: a tqdm bar if tqdm is installed, else lines on standard error."""

    def __init__(self, command: str) -> None:
        self._bar: Any = None
        try:
            from tqdm.auto import tqdm  # type: ignore[import]
            self._bar = tqdm(desc=command, bar_format="{desc} [{elapsed}]", leave=False)
        except ImportError:
            pass

    def show(self, line: str) -> None:
        if self._bar is not None:
            self._bar.set_description_str(line)
        else:
            print(line, file=sys.stderr)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


def _read_stderr(stream: IO[bytes], lines: List[str], progress: Optional[_Progress]) -> None:
    """Appends the lines of standard error to `lines`, and shows them as they arrive."""
    partial = b""
    while chunk := os.read(stream.fileno(), 4096):
        *complete, partial = (partial + chunk).replace(b"\r", b"\n").split(b"\n")
        for line in complete:
            text = line.decode("utf-8", "replace").strip()
            if not text:
                continue
            lines.append(text)
            if progress is not None:
                progress.show(text)
    if partial.strip():
        lines.append(partial.decode("utf-8", "replace").strip())


def execute(command: str, arguments: Sequence[str], progress: bool = False) -> Tuple[int, str, str]:
    """Runs a program and returns its exit status, standard output and standard error.

    An interrupt (Ctrl-C, or the stop button of a notebook) is passed to the program, which then ends with its best
    result.
    """
    shown = _Progress(command) if progress else None
    process = subprocess.Popen(
        [program(command), *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=True)
    assert process.stdout is not None and process.stderr is not None
    lines: List[str] = []
    reader = threading.Thread(target=_read_stderr, args=(process.stderr, lines, shown), daemon=True)
    reader.start()
    interrupts = 0
    output: List[bytes] = []
    while True:
        try:
            output.append(process.stdout.read())
            process.wait()
            reader.join()
            break
        except KeyboardInterrupt:
            interrupts += 1
            if interrupts > 1:  # the second one does not wait for a result
                process.kill()
                process.wait()
                raise
            process.send_signal(signal.SIGINT)
        except BaseException:
            process.kill()
            process.wait()
            raise
    process.stdout.close()
    process.stderr.close()
    if shown is not None:
        shown.close()
    return process.returncode, b"".join(output).decode("utf-8", "replace"), "\n".join(lines)


def positional_words(values: Sequence[Any]) -> Tuple[List[str], List[Any]]:
    """Returns the words of positional arguments, and the inputs that must exist during the run."""
    result: List[str] = []
    inputs: List[Any] = []
    for value in values:
        if isinstance(value, Scenario):
            folder = value.folder()
            inputs.append(folder)
            result.append(os.fspath(folder))
        elif isinstance(value, Results):
            inputs.append(value)
            result.append(os.fspath(value.folder()))
        elif isinstance(value, (str, os.PathLike)):
            if not os.fspath(value):
                raise BadInputError("the path is empty; name a scenario folder or a built-in scenario")
            result.append(os.fspath(value))
        elif isinstance(value, int) and not isinstance(value, bool):
            result.append(str(value))
        else:
            raise BadInputError(f"expected a path, a Scenario or a result, not {type(value).__name__}")
    return result, inputs


def _summary_of(output: str) -> Dict[str, Any]:
    """Returns the JSON document that a command printed; empty if it printed none."""
    try:
        return dict(json.loads(output)) if output.strip() else {}
    except json.JSONDecodeError:
        return {}


def run(result_type: Any, command: str, positional: Sequence[Any], options: Mapping[str, Any], progress: bool) -> Any:
    """Runs a command and returns its result. Without the option `out`, its files are in a temporary folder."""
    given = [value for value in positional if value is not None or options.get("config") is None]
    arguments, inputs = positional_words(given)
    chosen: Dict[str, Any] = dict(options)
    temporary = None
    lists = chosen.get("list") or (command == "study" and arguments[:1] in (["list"], ["show"]))
    if has_option(command, "out") and chosen.get("out") is None and not lists:
        temporary = TemporaryFolder()
        chosen["out"] = temporary.path / "run"
    if command != "study" and "plots" in chosen and chosen["plots"] is None:
        chosen["plots"] = "off"
    if progress and has_option(command, "verbose"):
        chosen["verbose"] = True
    status, output, errors = execute(command, [*arguments, *words(command, chosen), "--json"], progress)
    for folder_of_arrays in inputs:
        if isinstance(folder_of_arrays, ScenarioFolder):
            errors = folder_of_arrays.in_arguments(errors)
    message = last_message(errors)
    if status == _INVALID:
        raise BadInputError(message)
    if status not in (_SUCCESS, _INCOMPLETE, _MISFIT):
        how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
        raise Error(f"tandem {command} {how}: {message}")
    summary = _summary_of(output)
    folder = pathlib.Path(chosen["out"]).absolute() if chosen.get("out") is not None else None
    if status == _INCOMPLETE and not summary and (folder is None or not folder.exists()):
        raise Error(message)
    result = result_type._of_run(command, summary, folder, temporary)
    for text in summary.get("warnings", ()):
        warnings.warn(f"{command}: {text}", UserWarning, stacklevel=3)
    if status == _INCOMPLETE:
        result.incomplete = message
    elif status == _SUCCESS and summary.get("status", "converged") != "converged":
        # A plan that is stopped early meets its constraints, but is not optimal.
        result.incomplete = str(summary["message"])
    elif status == _MISFIT:
        error = MisfitError(message)
        error.result = result
        raise error
    if result.incomplete:
        warnings.warn(result.incomplete, IncompleteWarning, stacklevel=3)
    return result
