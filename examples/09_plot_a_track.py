# Plots a track while it runs: tandem track my_run --realtime --json-lines --rate 5 | python3 09_plot_a_track.py
import json, sys
import matplotlib.pyplot as plt

paths = {"chaser_m": [], "target_m": [], "ahead": []}  # positions in the world [m]
curves = {name: plt.plot([], [], label=name.removesuffix("_m"))[0] for name in paths}
plt.legend(), plt.axis("equal"), plt.xlabel("x [m]"), plt.ylabel("y [m]"), plt.ion()
for line in map(json.loads, sys.stdin):
    if line["schema"] != "tandem.track-line/1": break  # the last line is the summary
    for name in ("chaser_m", "target_m"): paths[name] += [line[name]] if name in line else []
    paths["ahead"] = [prediction["target_m"] for prediction in line["ahead"]]
    for name, curve in curves.items(): curve.set_data([p[0] for p in paths[name]], [p[1] for p in paths[name]])
    plt.title(f"{line['t']:.1f} s, {line['outputs']['target']}"), plt.gca().relim(), plt.gca().autoscale_view(), plt.pause(0.001)
plt.ioff(), plt.show()
