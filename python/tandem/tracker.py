"""Online tracking, line by line."""

import json
import subprocess
import threading
import warnings
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from ._options import has_option, words
from ._process import ScenarioLike, last_message, positional_words, program
from .errors import BadInputError, Error, IncompleteWarning
from .summary import Summary
from .scenario import Scenario, read_settings


class Tracker:
    """Tracks chaser and target online over a sliding window.

    The tracker runs `tandem track` with options of the same names. It gets lines in the order of arrival and returns an
    update for each new state: a dictionary with the keys of `tandem track --json-lines` (docs/file_formats.md).

    Args:
        scenario: settings of the sensors and noise; its data are not read.
        options: options of `tandem track`, for example window=30.

    >>> import tandem
    >>> s = tandem.read_scenario("docking_a")
    >>> with tandem.Tracker(s) as tracker:
    ...     for t, p, q in zip(s.odometry.t[:50], s.odometry.positions, s.odometry.quaternions):
    ...         tracker.add("odometry", t, *p, *q)
    ...     tracker.add_rows("usbl", s.measurements["usbl"][:1])
    ...     updates = tracker.finish()
    >>> updates[-1]["converged"]
    True
    """

    def __init__(self, scenario: ScenarioLike, **options: Any) -> None:
        arguments, self._inputs = positional_words([scenario])
        self._scenario = scenario if isinstance(scenario, Scenario) else read_settings(scenario)
        #: Summary of the run, after finish().
        self.summary: Optional[Summary] = None
        chosen = {name.replace("_", "-"): value for name, value in options.items()}
        reserved = {"out", "json", "quiet", "json-lines", "stdin", "realtime", "config", "print-config"}
        for name in chosen:
            if not has_option("track", name) or name in reserved:
                raise BadInputError(f"Tracker: unknown option {name.replace('-', '_')}; see help(tandem.track)")
        self._process = subprocess.Popen(
            [program("track"), *arguments, *words("track", chosen), "--stdin", "--json-lines"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1, start_new_session=True)
        self._updates: List[Dict[str, Any]] = []
        self._errors: List[str] = []
        self._finished = False
        self._lock = threading.Lock()
        self._readers = [threading.Thread(target=self._read, daemon=True),
                         threading.Thread(target=self._read_errors, daemon=True)]
        for reader in self._readers:
            reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                update = json.loads(line)
            except ValueError:
                continue
            if update.get("schema", "").startswith("tandem.track-line/"):  # the last line is a summary
                with self._lock:
                    self._updates.append(update)
            else:
                self.summary = Summary(update)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._errors.append(line.rstrip("\n"))

    def _send(self, text: str) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(text)
        except (BrokenPipeError, ValueError):
            self._fail()

    def _fail(self) -> None:
        self._process.wait()
        self._readers[1].join()
        raise Error("the tracker has ended: " + last_message("\n".join(self._errors)))

    def add(self, sensor: str, t: float, *values: float) -> None:
        """Adds one measurement: the name of a sensor, or "odometry", the time and the values of its CSV columns."""
        self.add_rows(sensor, [[t, *values]])

    def add_rows(self, sensor: str, rows: Any) -> None:
        """Adds measurements, one in each row: time and values, shape (n, columns).

        Raises BadInputError for an unknown sensor, a wrong number of columns and NaN. The tracker rejects rows that
        come too late or whose times jump; finish() warns of them.
        """
        if self._finished:
            raise Error("the tracker has finished; make a new Tracker to track more data")
        array = np.array(rows, dtype=float, ndmin=2)
        if array.ndim != 2:
            raise BadInputError(f"{sensor}: expected rows of shape (n, columns), not {array.shape}")
        columns = self._scenario.columns(sensor)
        if columns is not None and array.shape[1] != len(columns):
            raise BadInputError(f"{sensor}: expected {len(columns)} columns ({', '.join(columns)}), not "
                                f"{array.shape[1]}")
        if not np.isfinite(array).all():
            raise BadInputError(f"{sensor}: a row contains NaN or infinity")
        self._send("".join(sensor + "," + ",".join(repr(float(v)) for v in row) + "\n" for row in array))

    def updates(self) -> List[Dict[str, Any]]:
        """Returns the updates that have arrived since the last call. Does not wait."""
        with self._lock:
            result, self._updates = self._updates, []
        return result

    def finish(self) -> List[Dict[str, Any]]:
        """Ends the data, and returns all updates that have not been returned yet.

        Afterwards, `summary` has the summary of the run. Warns if rows were rejected; `rejected` counts them.
        """
        if self._finished:
            return self.updates()
        self._finished = True
        if self._process.stdin is not None and not self._process.stdin.closed:
            try:
                self._process.stdin.close()
            except BrokenPipeError:
                pass
        self._process.wait()
        for reader in self._readers:
            reader.join()
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        if self._process.returncode == 1:
            raise BadInputError(last_message("\n".join(self._errors)))
        if self._process.returncode != 0 and self._errors:
            warnings.warn(last_message("\n".join(self._errors)), IncompleteWarning, stacklevel=2)
        rejected = self.rejected
        if rejected:
            text = "; ".join(f"{lines} of {sensor} ({why})" for (sensor, why), lines in rejected.items())
            warnings.warn(f"the tracker rejected {sum(rejected.values())} rows: {text}", IncompleteWarning,
                          stacklevel=2)
        return self.updates()

    @property
    def rejected(self) -> Dict[Tuple[str, str], int]:
        """Numbers of rejected rows by sensor and reason, after finish()."""
        if self.summary is None:
            return {}
        return {(entry["sensor"], entry["why"]): entry["lines"] for entry in self.summary["rejected_lines"]}

    def close(self) -> None:
        """Ends the tracker without waiting for its results.

        >>> import tandem
        >>> tracker = tandem.Tracker("docking_a")
        >>> tracker.close()
        >>> tracker
        <Tracker: ended>
        """
        self._finished = True
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None and not stream.closed:
                try:
                    stream.close()
                except BrokenPipeError:
                    pass

    def __enter__(self) -> "Tracker":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Tracker: {'running' if self._process.poll() is None else 'ended'}>"
