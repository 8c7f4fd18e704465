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

# Name and result of the functions, and the description of their first argument if it may be a Scenario.
FUNCTIONS = {
    "estimate": ("estimate", "Estimate"),
    "navigate": ("navigate", "Navigation"),
    "calibrate": ("calibrate", "Results"),
    "models": ("models", "Results"),
    "tune": ("tune", "Results"),
    "compare": ("compare", "Results"),
    "plan": ("plan", "Plan"),
    "rendezvous": ("rendezvous", "Results"),
    "simulate": ("simulate", "Scenario"),
    "solve": ("solve_file", "Results"),
    "import": ("import_log", "Scenario"),
    "info": ("info", "Results"),
    "export": ("export", "Results"),
    "study": ("study", "Results"),
    "track": ("track", "Estimate"),
}


def python_name(option):
    name = option.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


def annotation(option):
    if not option["takes"]:
        return "bool"
    return "OptionValue"


def function(description):
    name, result = FUNCTIONS[description["command"]]
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
