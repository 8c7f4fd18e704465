"""Programs, numbers and tables for the scripts that measure docs/benchmarks.md."""

import json
import os
import re
import shlex
import shutil
import statistics
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DATA = os.path.join("..", "shared", "data")  # recordings, relative to ROOT


class Failure(Exception):
    """An error that ends the script and leaves the page as it is."""


class Session:
    """Runs the programs of a build folder and prints each command."""

    def __init__(self, build, temporary, full):
        self.build, self.temporary, self.full = build, temporary, full

    def run(self, *command, statuses=(0,)):
        """Runs a program of bin/ with ROOT as the current folder. Returns its standard output."""
        print("$", shlex.join(command), flush=True)
        program = os.path.join(self.build, "bin", command[0])
        try:
            done = subprocess.run([program, *command[1:]], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True)
        except OSError as error:
            raise Failure(f"cannot run {program}: {error.strerror}; build the targets tandem and benchmarks") from error
        if done.returncode not in statuses:
            message = done.stderr.strip() or done.stdout.strip()
            raise Failure(f"{shlex.join(command)}: exit status {done.returncode}: {message[-500:]}")
        return done.stdout

    def json(self, *command, statuses=(0,)):
        """Runs a command of tandem with --json. Returns the parsed output."""
        return json.loads(self.run("tandem", *command, "--json", statuses=statuses))

    def google(self, name, pattern=".", repetitions=5):
        """Runs a Google Benchmark program. Returns {benchmark: {field: median over the repetitions}}."""
        file = os.path.join(self.temporary, name + ".json")
        self.run(name, f"--benchmark_filter={pattern}", f"--benchmark_repetitions={repetitions}",
                 "--benchmark_min_time=0.2", f"--benchmark_out={file}", "--benchmark_out_format=json")
        with open(file, encoding="utf-8") as stream:
            entries = json.load(stream)["benchmarks"]
        found = {}
        for entry in entries:
            if entry.get("error_occurred"):
                raise Failure(f"{name}: {entry['name']}: {entry.get('error_message', 'failed')}")
            if entry.get("run_type") != "aggregate":
                found.setdefault(re.sub(r"/(real_time|(iterations|repeats):\d+)", "", entry["name"]), []).append(entry)
        if not found:
            raise Failure(f"{name} has no benchmark that matches {pattern}")
        return {key: {field: statistics.median(run[field] for run in runs)
                      for field, value in runs[0].items() if isinstance(value, (int, float))}
                for key, runs in found.items()}

    def folder(self, name):
        """Returns the path of a folder that does not exist yet."""
        path = os.path.join(self.temporary, name)
        shutil.rmtree(path, ignore_errors=True)
        return path


def fixed(value, decimals=3):
    """Returns a number with this many decimals, or a dash if there is none."""
    return "–" if value is None else f"{value:.{decimals}f}"


def significant(value):
    """Returns a number with two significant digits or all digits before the point."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.1f}" if value >= 1 else f"{value:.2g}"


def scientific(value):
    """Returns a number as 3e-9."""
    return "0" if value == 0 else re.sub(r"e([+-])0?", lambda m: "e" + m[1].replace("+", ""), f"{value:.0e}")


def table(header, rows):
    """Returns the lines of a Markdown table. The first column is aligned to the left."""
    lines = [header, ["---"] + ["---:"] * (len(header) - 1)] + rows
    return ["| " + " | ".join(str(cell) for cell in line) + " |" for line in lines]


def matched(pattern, text, program):
    """Returns all matches of a pattern in the output of a program; none is an error."""
    found = re.findall(pattern, text, re.MULTILINE)
    if not found:
        raise Failure(f"cannot read the output of {program}; adapt its pattern in scripts/benchmark_*.py")
    return found


def measurements(names):
    """Returns the functions measure_NAME among the names of a module, by NAME."""
    return {name[len("measure_"):]: value for name, value in names.items() if name.startswith("measure_")}
