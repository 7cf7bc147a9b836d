#!/usr/bin/env python3
"""Draws the cost of six scenes against their error, from docs/pictures/trade.json.

    trade_picture.py docs/pictures/trade.json docs/pictures/trade.svg [--measured FOLDER]

With --measured the data are first taken from FOLDER, where `promenade measure SCENE --trade --poses 40 --json FOLDER/NAME.json` has put what it found
of each. Filled dots are the error that the front says, rings that at 40 other poses and on three other walks.
"""
import argparse
import json
from pathlib import Path

COLOURS = ["#1b6ca8", "#c1440e", "#3a7d44", "#7b4ba8", "#b8860b", "#444444"]
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 430, 52, 170, 16, 48
MOST_JND = 2.5


def taken(data, folder):
    for scene in data["scenes"]:
        found = json.loads((folder / f"{scene['file']}.json").read_text())
        point = lambda p: [round(p["operations"], 3), round(p["error"]["jnd"], 2), p["error"]["measure"], round(p["elsewhere"]["jnd"], 2)]
        scene["points"] = [point(p) for p in found["front"]]


def drawn(data):
    x = lambda cost: LEFT + (WIDTH - LEFT - RIGHT) * cost
    y = lambda jnd: HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * min(jnd, MOST_JND) / MOST_JND
    text = lambda at, up, words, anchor="start", more="": f'<text x="{at:.1f}" y="{up:.1f}" text-anchor="{anchor}"{more}>{words}</text>'
    line = lambda a, b, c, d, colour, more="": f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" stroke="{colour}"{more}/>'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for jnd in (0, 0.5, 1, 1.5, 2, 2.5):
        parts += [line(x(0), y(jnd), x(1), y(jnd), "#888" if jnd == 1 else "#ddd"), text(x(0) - 6, y(jnd) + 4, jnd, "end")]
    for cost in (0, 0.2, 0.4, 0.6, 0.8, 1):
        parts += [text(x(cost), HEIGHT - BOTTOM + 18, f"{100 * cost:.0f}", "middle")]
    parts += [text(x(0.01), y(1) - 4, "just noticeable", more=' fill="#666"'), text(x(0.5), HEIGHT - 10, "operations, % of all of the scene", "middle"),
              text(14, y(1.25), "error, JND", "middle", f' transform="rotate(-90 14 {y(1.25):.1f})"')]
    for number, (scene, colour) in enumerate(zip(data["scenes"], COLOURS)):
        points = sorted(scene["points"])
        path = " ".join(f"{x(cost):.1f},{y(jnd):.1f}" for cost, jnd, *_ in points)
        parts += [f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>']
        for cost, jnd, _, elsewhere in points:
            parts += [f'<circle cx="{x(cost):.1f}" cy="{y(jnd):.1f}" r="3.5" fill="{colour}"/>',
                      f'<circle cx="{x(cost):.1f}" cy="{y(elsewhere):.1f}" r="3" fill="none" stroke="{colour}"/>']
        up = TOP + 14 + 34 * number
        parts += [text(WIDTH - RIGHT + 14, up, scene["name"], more=f' fill="{colour}" font-weight="bold"')]
        if scene.get("nearest"):
            parts += [line(x(0), y(scene["nearest"]), x(1), y(scene["nearest"]), colour, ' stroke-dasharray="4 4"'),
                      text(WIDTH - RIGHT + 14, up + 14, f"nearest measurement {scene['nearest']}", more=' fill="#666" font-size="11"')]
    return "\n".join([*parts, "</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--measured", type=Path)
    args = parser.parse_args()
    data = json.loads(args.data.read_text())
    if args.measured:
        taken(data, args.measured)
        rows = [", ".join(json.dumps(point) for point in scene["points"]) for scene in data["scenes"]]
        scenes = [f'    {json.dumps({k: v for k, v in s.items() if k != "points"})[:-1]}, "points": [{row}]}}' for s, row in zip(data["scenes"], rows)]
        head = ",\n".join(f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in data.items() if k != "scenes")
        args.data.write_text("{\n" + head + ',\n  "scenes": [\n' + ",\n".join(scenes) + "\n  ]\n}\n")
    args.picture.write_text(drawn(data))


if __name__ == "__main__":
    main()
