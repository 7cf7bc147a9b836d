#!/usr/bin/env python3
"""Makes the library: places of image sources at 48 kHz, each with a plan and its figures, from geometry alone.

    library.py PROMENADE HEAD.sofa FOLDER [--only NAME ...]

PROMENADE is the command-line tool, HEAD a set of free-field responses such as `MIT_KEMAR_normal_pinna.sofa` of Debian's `libmysofa1`. For
each place FOLDER receives `NAME.obj` (the room, metres, z up), `NAME.promenade` (the scene), `NAME.png` (level, T20, C50 and STI over the
plan), and all figures together in `README.md`. Fixed seeds: the same tool makes the same bytes. Needs nothing but Python.
"""
import argparse
import re
import subprocess
from pathlib import Path

SEED = 1
# Of the head that the places are heard with.
CREDIT = "Head: KEMAR HRTFs by W. G. Gardner and K. D. Martin, MIT Media Lab, 1994"
LICENCE = "free to use with citation of the authors (MIT Media Lab Perceptual Computing Technical Report 280)"


def prism(plan, height, walls, floor, ceiling):
    """Faces of an upright room: `plan` is its outline in order, `walls` a material for each side, `None` an opening."""
    count = len(plan)
    low = [(x, y, 0.0) for x, y in plan]
    high = [(x, y, height) for x, y in plan]
    faces = [(floor, [low[i] for i in range(count)])]
    if ceiling:
        faces.append((ceiling, [high[i] for i in reversed(range(count))]))
    for i, wall in enumerate(walls):
        if wall:
            j = (i + 1) % count
            faces.append((wall, [low[j], low[i], high[i], high[j]]))
    return faces


def box(x, y, z, walls, floor, ceiling):
    return prism([(0, 0), (x, 0), (x, y), (0, y)], z, walls, floor, ceiling)


def obj(faces):
    """The faces as a Wavefront file, a group for each material."""
    lines, start = [], 1
    for material, corners in faces:
        lines.append(f"g {material}")
        lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in corners]
        lines.append("f " + " ".join(str(start + i) for i in range(len(corners))))
        start += len(corners)
    return "\n".join(lines) + "\n"


# Name: title, faces, source, gain in dB, options. Materials are names of `promenade simulate materials`. Gains make places about as loud
# as each other; where waves would make a large file, they end lower.
PLACES = {
    "dry-studio": (
        "Dry studio, 5 x 4 x 2.8 m",
        box(5, 4, 2.8, ["mineral_wool_50mm_70kgm3", "curtains_velvet", "mineral_wool_50mm_70kgm3", "panel_fabric_covered_8pcf"],
            "carpet_1.35_kg_m2", "ceiling_melamine_foam"),
        (3.6, 2.2, 1.3), -5.1, []),
    "living-room": (
        "Living room, 6.2 x 4.4 x 2.5 m",
        box(6.2, 4.4, 2.5, ["plasterboard", "glass_window", "brickwork", "curtains_cotton_0.5"], "carpet_tufted_9.5mm", "ceiling_plasterboard"),
        (4.9, 2.0, 1.2), -6.7, []),
    "stairwell": (
        "Stairwell, 5.2 x 3 x 13 m",
        box(5.2, 3, 13, ["rough_lime_wash"] * 4, "concrete_floor", "rough_concrete"),
        (1.0, 0.9, 1.5), -9.7, ["--grid", "0.6"]),
    "corridor": (
        "Corridor, 28 x 2.1 x 2.6 m",
        box(28, 2.1, 2.6, ["plasterboard", "wooden_door", "plasterboard", "wooden_door"], "linoleum_on_concrete", "ceiling_fissured_tile"),
        (3.0, 1.0, 1.5), -7.1, ["--grid", "1.2"]),
    "club": (
        "Club, 16 x 11 x 4.2 m",
        box(16, 11, 4.2, ["brick_wall_rough", "curtains_velvet", "brick_wall_rough", "wood_16mm"], "concrete_floor", "ceiling_fibre_absorber"),
        (14.0, 5.5, 1.8), -1.8, ["--waves", "105"]),
    "l-shaped-loft": (
        "L-shaped loft, 12 x 9 m, 3.4 m high",
        prism([(0, 0), (12, 0), (12, 4.5), (5, 4.5), (5, 9), (0, 9)], 3.4,
              ["facing_brick", "glass_window", "plasterboard", "plasterboard", "facing_brick", "facing_brick"], "wood_1.6cm", "rough_concrete"),
        (2.4, 7.6, 1.5), -6.2, ["--waves", "105"]),
    "concert-hall": (
        "Concert hall, 42 x 21 x 16 m",
        box(42, 21, 16, ["wooden_lining"] * 4, "audience_upholstered_chairs_1", "plasterboard"),
        (37.5, 10.0, 1.6), 5.0, ["--height", "2"]),
    "cathedral": (
        "Cathedral nave, 62 x 19 x 27 m",
        box(62, 19, 27, ["lead_glazing", "limestone_wall", "lead_glazing", "limestone_wall"], "chairs_wooden", "rough_lime_wash"),
        (54.0, 9.0, 1.8), 2.2, ["--order", "4"]),
    "parking-deck": (
        "Parking deck, 48 x 32 x 2.5 m, open at two sides",
        box(48, 32, 2.5, ["rough_concrete", None, "rough_concrete", None], "concrete_floor", "rough_concrete"),
        (12.0, 14.0, 1.5), 1.3, []),
    "street": (
        "Street between houses, 60 x 13 m, 17 m high",
        box(60, 13, 17, ["smooth_brickwork_10mm_pointing", None, "smooth_brickwork_10mm_pointing", None], "concrete_floor", None),
        (22.0, 4.0, 1.6), 5.2, ["--grid", "4.5"]),
    "courtyard": (
        "Courtyard, 24 x 18 m, 12 m high",
        box(24, 18, 12, ["facing_brick"] * 4, "concrete_floor", None),
        (8.0, 7.0, 1.6), 2.4, []),
}


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{command[0]} {command[1]}: {done.stderr.strip()}")
    return done.stdout + done.stderr


def median(text, name):
    found = re.search(rf"^{re.escape(name)}\S*.*?\s(\S+)\s+(\S+)\s+(\S+)\s+\d+ of", text, re.MULTILINE)
    return found.group(2) if found else "-"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade", type=Path)
    parser.add_argument("head", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=PLACES, default=list(PLACES))
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rows = ["| Place | File | kB | T20, s | C50, dB | STI |", "|---|---|---|---|---|---|"]
    for name in args.only:
        title, faces, source, gain, options = PLACES[name]
        mesh, scene, plan = (args.folder / f"{name}{end}" for end in (".obj", ".promenade", ".png"))
        mesh.write_text(obj(faces))
        place = ["--source", ",".join(map(str, source))]
        run([args.promenade, "simulate", mesh, *place, "--head", args.head, "--rays", 65536, "--gain", gain, "--seed", SEED, "--title", title, "--credit", CREDIT, "--licence", LICENCE, *options, "-o", scene])
        with_front = scene.with_suffix(".front.promenade")
        run([args.promenade, "bake", "less", scene, "-o", with_front])
        with_front.replace(scene)
        longest = max(max(corner[:2]) for _, corners in faces for corner in corners)
        figures = run([args.promenade, "map", mesh, *place, "--rays", 16384, "--length", 8, "--grid", longest / 20, "--seed", SEED, "-o", plan])
        values = [median(figures, measure) for measure in ("T20", "C50", "STI")]
        rows.append(f"| {title} | `{scene.name}` | {scene.stat().st_size // 1000} | {' | '.join(values)} |")
        print(rows[-1], flush=True)
    total = sum((args.folder / f"{name}.promenade").stat().st_size for name in args.only)
    text = "# Places of the library\n\nMedians over the plan.\n\n" + "\n".join(rows) + f"\n\n{total / 1e6:.1f} MB in all.\n"
    (args.folder / "README.md").write_text(text)


if __name__ == "__main__":
    main()
