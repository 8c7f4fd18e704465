"""Measurement of the tables of docs/benchmarks.md on the recordings of ../shared, for scripts/benchmarks.

Each function measure_NAME runs the commands of one table and returns its lines. The columns called tuned have the model
that `tandem tune` finds with its default time limit and without truth.
"""

import csv
import os
import shlex
import statistics
import time

from benchmark_session import DATA, Failure, fixed, measurements, table

CARS = ["kitti_0000_000", "kitti_0002_005", "kitti_0004_002", "kitti_0006_012", "kitti_0008_008", "kitti_0010_000",
        "kitti_0011_000", "kitti_0018_003", "kitti_0020_012"]
FERRIES = ["ferry_16_1", "ferry_22_1", "ferry_22_2"]
FERRY = shlex.split("--model white-noise-acceleration --noise acceleration=0.7,0.7,0.05 --non-holonomic soft --surge 0,0 "
                    "--limits soft --noise surge=21 --noise camera=0.4 --noise lidar=2.5,0.05 --noise radar=2.5,0.05")
AUV = shlex.split("--error dvl=0.02,0.02,0.02:100 --error depth=0.3:100")
ROV = shlex.split("--error dvl.scale=0.05 --error dvl.misalignment=0.05 --error dvl.delay=0.3 --error gps.delay=0.3")
MAV = ["--error", "gps.delay=0.3", "--vibration"]
DIVES = {"auv_akit_01": ("a", AUV), "auv_akit_03": ("a", AUV), "rov_blueye_auto_square": ("b", AUV + ROV),
         "rov_blueye_grid": ("b", AUV + ROV), "mav_euroc_mh01": ("c", MAV)}


def recording(scenario):
    return os.path.join(DATA, scenario)


def tuned(session, scenario):
    """Finds the model of a recording. Returns the options that use it, and the seconds that the search took."""
    out = session.folder("tuned")
    begin = time.monotonic()
    session.run("tandem", "tune", recording(scenario), "--out", out, "--quiet")
    return ["--config", os.path.join(out, "run.yaml")], time.monotonic() - begin


def estimated(session, scenario, *options):
    """Estimates a recording. Returns the summary and the mean NEES by axes of the relative position."""
    out = session.folder("estimate")
    summary = session.json("estimate", recording(scenario), *options, "--plots", "off", "--out", out, statuses=(0, 2))
    if summary["status"] != "converged":
        raise Failure(f"tandem estimate {scenario} {shlex.join(options)}: {summary['status']}")
    sums = []
    with open(os.path.join(out, "errors.csv"), encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            axes = [(row[f"error_{a}_m"], row[f"three_sigma_{a}_m"]) for a in "xyz"]
            if all(error and sigma for error, sigma in axes):
                sums.append(sum((3 * float(e) / float(s)) ** 2 for e, s in axes if float(s) > 0))
    return summary, statistics.fmean(sums) if sums else None


def measure_cars(session):
    rows = []
    for scenario in CARS:
        options, seconds = tuned(session, scenario)
        runs = [estimated(session, scenario, *choice) for choice in ([], ["--robust"], options)]
        cells = [scenario, runs[0][0]["keyframes"], fixed(runs[0][0]["errors"]["all"]["raw_position_mean_m"])]
        for summary, nees in runs:
            errors = summary["errors"]["all"]
            cells += [fixed(errors["position_mean_m"]), fixed(errors["orientation_mean_deg"], 2), fixed(nees, 1)]
        rows.append([*cells, fixed(seconds, 0)])
    columns = ["[m]", "[°]", "NEES"]
    return table(["", "keyframes", "measured [m]", *columns, *(f"robust {column}" for column in columns),
                  *(f"tuned {column}" for column in columns), "time of tune [s]"], rows)


def measure_ferries(session):
    rows = []
    for scenario in FERRIES:
        options, seconds = tuned(session, scenario)
        runs = [estimated(session, scenario, *choice) for choice in ([], FERRY, options)]
        plain = runs[0][0]
        cells = [scenario, plain["keyframes"]]
        cells += [fixed(plain["sensors"][sensor].get("raw_position_mean_m")) for sensor in ("lidar", "radar")]
        for summary, nees in runs:
            cells += [fixed(summary["errors"]["all"]["position_mean_m"]), fixed(nees, 1)]
        rows.append([*cells, fixed(seconds, 0)])
    return table(["", "keyframes", "lidar [m]", "radar [m]", "[m]", "NEES", "options [m]", "options NEES", "tuned [m]",
                  "tuned NEES", "time of tune [s]"], rows)


def measure_dives(session):
    def cells(folder, options):
        result = session.json("navigate", folder, *options, statuses=(0, 2))
        if result["status"] != "converged":
            return ["not converged", "–", "–", "–"]
        errors, outages = result["errors"]["all"], result.get("gps_outages") or []
        longest = max(outages, key=lambda outage: outage["to"] - outage["from"], default={})
        return [fixed(errors["position_mean_m"]), fixed(errors.get("orientation_mean_deg"), 2),
                fixed(longest.get("drift_percent"), 2), fixed(errors.get("position_nees"), 1)]

    rows = []
    for grade in ("tactical", "mems"):
        folder = session.folder("dive_" + grade)
        session.run("tandem", "simulate", "dive", "--grade", grade, "--seed", "1", "--out", folder)
        rows.append([f"simulated, {grade}", *cells(folder, []), *["–"] * 10])
    for name, (letter, chosen) in DIVES.items():
        options, seconds = tuned(session, name)
        rows.append([name, *cells(recording(name), []), letter, *cells(recording(name), chosen),
                     *cells(recording(name), options), fixed(seconds, 0)])
    columns = ["[m]", "[°]", "drift [%]", "NEES"]
    return table(["", *columns, "options", *columns, *("tuned " + column for column in columns), "time of tune [s]"], rows)


TABLES = measurements(globals())
