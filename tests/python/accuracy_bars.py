"""Draws the README's bars of docs/pictures/accuracy.json: errors in just noticeable differences.

usage: accuracy_bars.py docs/pictures/accuracy.json docs/pictures/accuracy.png

Needs matplotlib.
"""
import json
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

HEIGHT = 0.38
SERIES = [("promenade", 0, "#2a6fb0", "Promenade"), ("nearest", HEIGHT, "#b8b8b8", "nearest measurement")]


def main():
    data_file, picture = sys.argv[1:]
    with open(data_file, encoding="utf-8") as file:
        data = json.load(file)
    measures, rooms = data["measures"], data["rooms"]
    figure, axes = pyplot.subplots(1, len(rooms), figsize=(9, 2.8), sharey=True, layout="constrained")
    for room, axis in zip(rooms, axes, strict=True):
        for of, offset, colour, label in SERIES:
            shares = [error / measure["just_noticeable"] for error, measure in zip(room[of], measures, strict=True)]
            bars = axis.barh([row + offset for row in range(len(measures))], shares, HEIGHT, color=colour, label=label)
            labels = [f"{error:g} {measure['unit']}" for error, measure in zip(room[of], measures, strict=True)]
            axis.bar_label(bars, labels, padding=3, fontsize=8)
        axis.axvline(1, color="#c03030", linestyle="--", linewidth=1)
        axis.set_title(room["name"], fontsize=10)
        axis.set_xlim(0, 2.4)
        axis.set_xlabel("just noticeable differences", fontsize=9)
        axis.spines[["top", "right"]].set_visible(False)
    labels = [f"{measure['name']} ({measure['just_noticeable']} {measure['unit']})" for measure in measures]
    axes[0].set_yticks([row + HEIGHT / 2 for row in range(len(measures))], labels)
    axes[0].invert_yaxis()
    axes[0].legend(fontsize=8, loc="lower right", frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main()
