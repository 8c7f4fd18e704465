"""Measurement of the tables of docs/benchmarks.md that need no recordings of ../shared, for scripts/benchmarks.

Each function measure_NAME runs the commands of one table and returns its lines.
"""

import csv
import os
import re
import shlex
import statistics
import subprocess

from benchmark_session import ROOT, Failure, fixed, matched, measurements, scientific, significant, table

CONSTRAINTS = {"none": [], "soft": shlex.split("--non-holonomic soft --surge 0,2.5 --limits soft"),
               "hard": shlex.split("--non-holonomic hard --surge 0,2.5 --roll-pitch hard --limits hard")}


def errors_on_docking_a(session):
    best = "white-noise-acceleration+non-holonomic:hard"
    titles = {"constant-twist": "Mode A: constant twist", "mode-b": "Mode B", "constant-velocity": "constant velocity",
              "damped-twist": "damped twist", "white-noise-acceleration": "white-noise acceleration",
              best: "white-noise acceleration, no sway or heave"}
    commands = [["models", "docking_a"], ["models", "docking_a", "--models", best]]
    results = {result["model"]: result for command in commands for result in session.json(*command)["models"]}
    first = results["constant-twist"]["errors"]
    rows = [["measurements alone", fixed(first["position"]["raw_position_mean_m"]),
             fixed(first["pose"]["raw_position_mean_m"]), "–", "–",
             fixed(first["pose"]["raw_orientation_mean_deg"], 2), "–"]]
    for model, title in titles.items():
        if results.get(model, {}).get("status") != "converged":
            raise Failure(f"tandem models docking_a: {model} is missing or did not converge")
        errors = [results[model]["errors"][kind] for kind in ("position", "pose", "none")]
        rows.append([title] + [fixed(e.get("position_mean_m")) for e in errors]
                    + [fixed(e.get("orientation_mean_deg"), 2) for e in errors])
    return [["`docking_a`", *row, "–"] for row in rows]


def errors_of_simulated_dockings(session):
    out = session.folder("table1")
    session.run("tandem", "study", "run", "table1", "--out", out, "--quiet")

    def read(name):
        with open(os.path.join(out, name), encoding="utf-8", newline="") as stream:
            return {(row["model"], row["metric"]): row for row in csv.DictReader(stream)}

    means, consistency = read("summary.csv"), read("consistency.csv")

    def mean(model, metric, decimals):
        row = means.get((model, metric))
        if not row:
            return "–"
        return f"{float(row['mean']):.{decimals}f} ± {(float(row['high']) - float(row['low'])) / 2:.{decimals}f}"

    trials = means["constant-twist", "at_all_error_m"]["n"]

    def row(title, model, prefix):
        nees = None if prefix else consistency[model, "nees_relative_position"]
        errors = [mean(model, f"{prefix}at_{kind}_error_m", 3) for kind in ("position", "pose", "none")]
        return [f"{trials} seeds", title, *errors, "–", mean(model, f"{prefix}at_pose_orientation_deg", 2), "–",
                fixed(float(nees["mean"]) if nees else None, 2)]

    return [row("measurements alone", "constant-twist", "raw_"), row("Mode A", "constant-twist", ""),
            row("Mode B", "mode-b", "")]


def measure_accuracy(session):
    return table(["", "model", "position [m]", "pose [m]", "none [m]", "position [°]", "pose [°]", "none [°]", "NEES"],
                 errors_on_docking_a(session) + errors_of_simulated_dockings(session))


def measure_live_constraints(session):
    seeds = 20 if session.full else 5
    scenarios = {"`docking_a`": ["docking_a"], f"simulated, {seeds} seeds": []}
    for seed in range(1, seeds + 1):
        folder = session.folder(f"docking_{seed}")
        session.run("tandem", "simulate", "docking", "--seed", str(seed), "--minutes", "6", "--quiet", "--out", folder)
        scenarios[f"simulated, {seeds} seeds"].append(folder)

    def means(folders, mode, options):
        runs = [session.json("track", folder, "--newest", "window", "--mode", mode, *options, statuses=(0, 2))
                for folder in folders]
        values = [[run["errors"]["all"]["position_mean_m"], run["predictions"][0]["position_mean_m"],
                   run["predictions"][1]["position_mean_m"], run["errors"]["all"]["position_nees_mean"],
                   run["update_processor_ms"]["p50"], run["update_processor_ms"]["p99"]] for run in runs]
        return [fixed(statistics.mean(column), 3 if k < 3 else 2) for k, column in enumerate(zip(*values))]

    rows = [[title, role, *means(folders, "A", options), *means(folders, "B", options)]
            for title, folders in scenarios.items() for role, options in CONSTRAINTS.items()]
    numbers = ["newest [m]", "5 s ahead [m]", "10 s ahead [m]", "NEES", "p50 [ms]", "p99 [ms]"]
    return table(["", "constraints", *(f"{mode}: {number}" for mode in "AB" for number in numbers)], rows)


def measure_online(session):
    names = {"motion hypotheses (default)": "motion hypotheses (default)",
             "constant-twist": "window of 60 s, Mode A", "constant-twist, mode B": "window of 60 s, Mode B"}
    text = session.run("bench_online", "docking_a")
    best = matched(r"^docking_a((?: +[\d.]+){5}) +m: best filter settings$", text, "bench_online")[0].split()
    rows = [["Kalman filter, constant velocity", *best, "–", "–", "–"]]
    for line in text.splitlines():
        title = names.get(re.split(r"  +", line)[0])
        if not title:
            continue
        errors = matched(r"  +([\d.]+) \([\d.]+, [\d.]+; +([\d.]+)\)", line, "bench_online")
        p50, p99 = matched(r"([\d.]+), ([\d.]+)$", line, "bench_online")[0]
        rows.append([title, *(error for error, _ in errors), errors[0][1], p50, p99])
    if len(rows) != 1 + len(names):
        raise Failure("bench_online does not print all of " + "; ".join(names))
    return table(["", "position [m]", "pose [m]", "none [m]", "5 s ahead [m]", "10 s ahead [m]", "NEES", "p50 [ms]",
                  "p99 [ms]"], rows)


def measure_solvers(session):
    command = ["compare", "docking_a", "--solvers", "gauss-newton,augmented-lagrangian,ipopt,nlopt:lbfgs",
               "--constraints", "off,hard"]
    runs = [session.json(*command, statuses=(0, 2))["solves"] for _ in range(3)]
    rows = []
    for solves in zip(*runs):
        solve = solves[0]
        if solve.get("seconds") is None:  # the solver does not support hard constraints
            continue
        hard = solve["constraints"] == "hard"
        rows.append([solve["solver"], solve["constraints"], solve["status"], f"{solve['cost']:.6f}",
                     scientific(solve["violation"]) if hard else "–", solve["iterations"],
                     significant(1e3 * statistics.median(run["seconds"] for run in solves)),
                     fixed(solve["peak_memory_bytes"] * 1e-6, 0)])
    return table(["", "constraints", "status", "cost", "violation [m/s]", "iterations", "time [ms]", "memory [MB]"], rows)


def measure_programs(session):
    found = matched(r"^(\S+)" + 5 * r" (\d+)" + 2 * r" (\S+)" + "$", session.run("bench_programs"), "bench_programs")
    rows = [[name, problems, converged, at_minimum, median, most, scientific(float(stationarity)),
             scientific(float(violation))]
            for name, problems, converged, at_minimum, median, most, stationarity, violation in found]
    return table(["", "problems", "converged", "at the known minimum", "iterations, median", "iterations, most",
                  "stationarity", "violation"], rows)


def measure_ceres(session):
    found = session.google("bench_gauss_newton")
    rows = []

    def row(title, cost, ours, our_iterations, theirs, their_iterations):
        rows.append([title, cost, significant(ours), f"{our_iterations:.0f}", significant(theirs),
                     f"{their_iterations:.0f}", f"{theirs / ours:.1f}"])

    for kind, title in (("to_reference", "`docking_a`, to the reference cost"),
                        ("to_convergence", "`docking_a`, to convergence")):
        ours, theirs = found["gauss_newton/" + kind], found["ceres_solve/" + kind]
        row(title, f"{ours['cost']:.4f}", ours["real_time"], ours["iterations"], theirs["real_time"],
            theirs["iterations"])
    texts = [session.run("bench_pose_graph") for _ in range(3)]
    pattern = (r"^(\w+): (\d+) poses.*\n"
               r"  gauss-newton +converged +(\S+) in ([\d.]+) s, (\d+) iterations from odometry.*\n"
               r"(?:  chordal.*\n  gauss-newton.*\n)  ceres +usable +\S+ in ([\d.]+) s, (\d+) iterations$")
    for graphs in zip(*(matched(pattern, text, "bench_pose_graph") for text in texts)):
        name, poses, cost, _, ours_iterations, _, their_iterations = graphs[0]
        row(f"{name}, {int(poses):,} poses", cost, statistics.median(1e3 * float(g[3]) for g in graphs),
            int(ours_iterations), statistics.median(1e3 * float(g[5]) for g in graphs), int(their_iterations))
    return table(["", "cost", "Tandem [ms]", "iterations", "Ceres [ms]", "iterations", "ratio"], rows)


def measure_scaling(session):
    rows = []
    for keyframes in [1000, 10000, 100000] + ([1000000] if session.full else []):
        found = session.google("bench_scaling", f"^gauss_newton/{keyframes}/", 1 if keyframes > 100000 else 3)
        run = found[f"gauss_newton/{keyframes}"]
        rows.append([f"{keyframes:,}", f"{12 * keyframes:,}", f"{run['iterations']:.0f}",
                     significant(1e-3 * run["real_time"]), fixed(run["us_per_iteration_and_keyframe"], 2),
                     fixed(run["peak_MiB"], 0)])
    return table(["keyframes", "unknowns", "iterations", "time [s]", "µs per iteration and keyframe",
                  "peak memory [MiB]"], rows)


def measure_building_blocks(session):
    residuals = {"constant_twist_SE3": "constant twist", "relative_pose": "relative pose",
                 "usbl_position": "USBL position"}
    found = session.google("bench_residuals", "^evaluate/")
    columns = [[f"residual and Jacobians: {title}", significant(1e-3 * found["evaluate/" + key]["real_time"]), "–"]
               for key, title in residuals.items()]
    found = session.google("bench_marginals", "^marginals/soft")
    columns.append(["covariances of `docking_a`, 1,538 keyframes",
                    significant(1e3 * found["marginals/soft"]["real_time"]), "–"])
    lag = {"processor time": "fixed-lag smoother: update", "marginalising": "marginalisation, part of the update",
           "covariance of newest pair": "fixed-lag smoother: newest covariance"}
    times = {title.strip(): cells for title, *cells in
             matched(r"^ *(\S.*?)  +p50 +([\d.]+) ms +p99 +([\d.]+) ms", session.run("bench_fixed_lag"),
                     "bench_fixed_lag")}
    if not lag.keys() <= times.keys():
        raise Failure("bench_fixed_lag does not print all of: " + "; ".join(lag))
    for key, title in lag.items():
        columns.append([title, *(significant(1e3 * float(value)) for value in times[key])])
    header, *rows = zip(["", "p50 [µs]", "p99 [µs]"], *columns)
    return table(header, rows)


def measure_planning(session):
    pattern = (r"^(.+?)  +(\S.*?) +\d+ steps: cold +([\d.]+) ms; warm median +([\d.]+), 99 % +([\d.]+), "
               r"worst +([\d.]+) ms; +(\d+) iterations; \d+ of (\d+) by damped-sqp, (\d+) accepted, violation \S+$")
    rows, vehicles = [], []
    for steps in ("20", "50"):
        text = session.run("bench_planning", steps, "100", "all")
        plans = {}
        for vehicle, solver, cold, median, p99, _, iterations, replans, accepted in matched(
            pattern, text, "bench_planning"):
            if solver == "damped-sqp first":  # the default of the planner
                times = [significant(float(value)) for value in (cold, median, p99)]
                plans[vehicle] = [*times, iterations, f"{accepted} of {replans}"]
        vehicles = vehicles or list(plans)
        if list(plans) != vehicles:
            raise Failure(f"bench_planning {steps} does not print the vehicles {', '.join(vehicles)}")
        rows.append([steps, *(cell for plan in plans.values() for cell in plan)])
    numbers = ["first plan [ms]", "p50 [ms]", "p99 [ms]", "iterations", "accepted"]
    return table(["steps", *(f"{vehicle}: {number}" for vehicle in vehicles for number in numbers)], rows)


def measure_rendezvous(session):
    seeds = "1000" if session.full else "100"
    command = ["rendezvous", "--seeds", seeds, "--methods", "decoupled,pursuit"]
    rows = []
    for name, result in session.json(*command)["methods"].items():
        low, high = result["rate_95"]
        rows.append([name, f"{result['docked']} of {result['runs']} ({100 * low:.0f} to {100 * high:.0f} %)",
                     fixed(result.get("seconds_median"), 0), fixed(result.get("least_miss_median_m"), 2),
                     result["keep_out_violations"], fixed(result.get("solve_median_ms"), 1),
                     fixed(result.get("solve_99_ms"), 1)])
    return table(["", "docked (95 %)", "time [s]", "miss [m]", "keep-out violations", "replan p50 [ms]", "p99 [ms]"], rows)


def scripted(session, *command, statuses=(0,)):
    """Runs a script with the Python package of the build. Returns the lines of the table that it prints."""
    print("$", shlex.join(command), flush=True)
    environment = {**os.environ, "PYTHONPATH": os.path.join(session.build, "python")}
    done = subprocess.run([os.path.join(ROOT, command[0]), *command[1:]], cwd=ROOT, env=environment,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("|")]
    if done.returncode not in statuses or len(lines) < 3:
        raise Failure(f"{shlex.join(command)}: exit status {done.returncode}: {done.stderr.strip()[-500:]}")
    return lines


def measure_gtsam(session):
    return scripted(session, "scripts/gtsam_benchmark")


def measure_python(session):
    return scripted(session, "scripts/python_benchmarks")


def measure_faults(session):
    command = ["scripts/fault_matrix", "--seconds", "60"]
    lines = scripted(session, *command, "--build", session.build, statuses=(0, 1))
    header, _, *rows = [line.strip("| ").split(" | ") for line in lines]
    found = {}  # results of each fault by recording and sensor, then by command
    for recording, sensor, tried, *results in rows:
        found.setdefault((recording, sensor), {})[tried] = results
    columns = [[f"{recording}: {sensor}", *(" ".join(results) for results in zip(*(
        by_command.get(tried, ["-"] * len(header[3:])) for tried in ("navigate", "estimate", "track"))))]
               for (recording, sensor), by_command in found.items()]
    faults, *rows = zip(["", *header[3:]], *columns)
    return table(faults, rows)


TABLES = measurements(globals())
