"""Plots a track while it runs.

tandem track my_run --realtime --json-lines --rate 5 | python3 09_plot_a_track.py
"""

import json
import sys

import matplotlib.pyplot as plt

paths = {"chaser_m": [], "target_m": [], "ahead": []}  # positions in the world [m]
figure, axes = plt.subplots()
curves = {name: axes.plot([], [], label=name.removesuffix("_m"))[0] for name in paths}
axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", adjustable="datalim")
axes.legend()
plt.ion()

for line in map(json.loads, sys.stdin):
    if line["schema"] != "tandem.track-line/1":  # the last line is the summary
        break
    for name in ("chaser_m", "target_m"):
        if name in line:
            paths[name].append(line[name])
    paths["ahead"] = [prediction["target_m"] for prediction in line["ahead"]]  # predictions from this instant
    for name, curve in curves.items():
        curve.set_data([p[0] for p in paths[name]], [p[1] for p in paths[name]])
    axes.set_title(f"{line['t']:.1f} s, target {line['outputs']['target']}")
    axes.relim()
    axes.autoscale_view()
    plt.pause(0.001)

plt.ioff()
plt.show()
