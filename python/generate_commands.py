"""Writes the functions of the package that run commands: generate_commands.py OUTPUT OPTIONS.json...

Each option of a command becomes a keyword argument with the same name, hyphens as underscores. The descriptions come
from `tandem-COMMAND --reference json`.
"""

import json
import keyword
import sys
import textwrap

# Options that the package sets itself.
HIDDEN = {"json", "quiet", "print-config", "json-lines", "stdin", "realtime"}

# Name, result and example of the functions.
FUNCTIONS = {
    "estimate": ("estimate", "Estimate", """
        >>> result = tandem.estimate("docking_a", max_keyframes=60, non_holonomic="hard", noise={"usbl": (2, 2, 3)})
        >>> result.converged, result.target.positions.shape[1]
        (True, 3)"""),
    "navigate": ("navigate", "Navigation", """
        >>> dive = tandem.simulate("dive", minutes=1, seed=1)
        >>> result = tandem.navigate(dive, without="heading")
        >>> result.converged, result.chaser.positions.shape[1]
        (True, 3)"""),
    "calibrate": ("calibrate", "Results", """
        >>> result = tandem.calibrate("docking_a", max_keyframes=60, mode="B", free="usbl")
        >>> len(result.noise["usbl"])
        3"""),
    "models": ("models", "Results", """
        >>> result = tandem.models("docking_a", max_keyframes=40, models="constant-twist,damped-twist")
        >>> len(result.table("models")["model"])
        2"""),
    "tune": ("tune", "Results", """
        >>> tandem.tune("docking_a", dry_run=True, only="noise").converged
        True"""),
    "compare": ("compare", "Results", """
        >>> result = tandem.compare("docking_a", max_keyframes=40, solvers="gauss-newton")
        >>> print(*set(result.table("compare")["solver"]))
        gauss-newton"""),
    "plan": ("plan", "Plan", """
        >>> plan = tandem.plan("docking_a", at=600, horizon=10, step=0.5)
        >>> plan.chaser.positions.shape
        (21, 3)"""),
    "rendezvous": ("rendezvous", "Results", """
        >>> result = tandem.rendezvous(duration=10, seeds=1)
        >>> "rendezvous.csv" in result.files
        True"""),
    "simulate": ("simulate", "Scenario", """
        >>> tandem.simulate("docking", minutes=5, seed=3).name
        'docking_3'"""),
    "solve": ("solve_file", "Results", """
        >>> p = tandem.Problem()
        >>> block = p.minimize(tandem.Prior(tandem.R1([1.0])), 1.0, p.add(tandem.R1([0.0]), "x"))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     p.write(os.path.join(folder, "problem.json"))
        ...     round(tandem.solve_file(os.path.join(folder, "problem.json")).summary.cost, 6)
        0.0"""),
    "import": ("import_log", "Scenario", """
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     table = os.path.join(folder, "usbl.csv")
        ...     with open(table, "w") as file:
        ...         _ = file.write("time,x,y,z\\n0,1,2,3\\n1,2,3,4\\n")
        ...     tandem.import_log(table, list=True).summary.format
        'table'"""),
    "info": ("info", "Results", """
        >>> tandem.info("docking_a").summary.name
        'docking_a'"""),
    "export": ("export", "Results", """
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     result = tandem.estimate("docking_a", max_keyframes=20, out=os.path.join(folder, "run"))
        ...     tandem.export(result, format="kml", origin="54,10", out=os.path.join(folder, "map")).files
        ['chaser.kml', 'chaser_truth.kml', 'run.yaml', 'target.kml', 'target_truth.kml']"""),
    "study": ("study", "Results", """
        >>> tandem.study("list").converged
        True"""),
    "track": ("track", "Estimate", """
        >>> tandem.track("docking_a", until=60, window=20).converged
        True"""),
}


def python_name(option):
    name = option.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


def annotation(option):
    if not option["takes"]:
        return "bool"
    return "OptionValue"


def function(description):
    name, result, example = FUNCTIONS[description["command"]]
    positional = [o for o in description["options"] if o["positional"]]
    options = [o for o in description["options"] if not o["positional"] and o["name"] not in HIDDEN]
    parameters = []
    for option in positional:
        of = {"SCENARIO": "ScenarioLike", "DIR": "ResultLike"}.get(option["takes"], "PathLike")
        if option["required"] and of == "ScenarioLike":  # or in the run file `config`
            parameters.append(f"{python_name(option['name'])}: Optional[{of}] = None")
        elif option["required"]:
            parameters.append(f"{python_name(option['name'])}: {of}")
        else:
            parameters.append(f"*{python_name(option['name'])}: {of}")
    if not any(p.startswith("*") for p in parameters):
        parameters.append("*")
    for option in options:
        default = "False" if not option["takes"] else "None"
        parameters.append(f"{python_name(option['name'])}: {annotation(option)} = {default}")
    parameters.append("progress: bool = False")
    lines = [f"def {name}(", *(f"    {p}," for p in parameters), f") -> {result}:"]
    command = description["command"]
    doc = [f"{description['summary']}.", "", f"Runs `tandem {command}` with options of the same names.", ""]
    group = None
    for option in positional + options:
        if option["group"] != group:
            group = option["group"]
            doc.append(f"{group or 'Arguments'}:")
        takes = f" ({option['takes']})" if option["takes"] else ""
        text = f"{python_name(option['name'])}{takes}: {option['help']}."
        doc += textwrap.wrap(text, 108, initial_indent="    ", subsequent_indent="        ")
    doc += ["Progress:", "    progress: Show a progress bar, by tqdm if it is installed."]
    imports = ">>> import tandem" + (", os, tempfile" if "tempfile" in example else "")
    doc += ["", imports, *textwrap.dedent(example).strip().splitlines()]
    body = "\n".join("    " + line if line else "" for line in doc).replace("\\", "\\\\")
    lines += [f'    """{body.strip()}', '    """']
    words = ", ".join(("*" if not o["required"] else "") + python_name(o["name"]) for o in positional)
    lines += [f"    return _run(", f"        {result},", f"        {description['command']!r},", f"        [{words}],",
              "        {"]
    lines += [f"            {o['name']!r}: {python_name(o['name'])}," for o in options]
    lines += ["        },", "        progress,", "    )"]
    return "\n".join(lines)


def main(output, descriptions):
    parts = []
    names = []
    declared = {}
    for path in descriptions:
        with open(path, encoding="utf-8") as file:
            description = json.load(file)
        parts.append(function(description))
        names.append(FUNCTIONS[description["command"]][0])
        declared[description["command"]] = {o["name"]: [o["takes"], o["repeatable"]] for o in description["options"]}
    header = [
        '"""Functions that run the commands of Tandem. Generated from the options of the commands; do not edit."""',
        "",
        "from typing import Optional",
        "",
        "from ._options import OptionValue, PathLike, declare",
        "from ._process import ResultLike, ScenarioLike, run as _run",
        "from .results import Estimate, Navigation, Plan, Results",
        "from .scenario import Scenario",
        "",
        f"__all__ = {names!r}",
        "",
        f"declare({json.dumps(declared, ensure_ascii=False)})".replace("false", "False").replace("true", "True"),
        "",
        "",
    ]
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n".join(header) + "\n\n\n".join(parts) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
