#!/usr/bin/env python3
"""Makes the factory scenes again from their recipes: the measured rooms, and the loft.

    factory.py PROMENADE IOSR HEAD.sofa [--only NAME ...]

PROMENADE is the command-line tool, IOSR the folder with `Room_A/16kHz/*.wav` and `Room_B/16kHz/*.wav`, HEAD a set of free-field responses such as
`MIT_KEMAR_normal_pinna.sofa` of Debian's `libmysofa1`. A test compares the scenes of the rooms with what their recipes make.

Projects name the loft by its content: the plugin's list of them and the preset that plays it are given the new one, which needs the package blake3.
Where the loft sounds otherwise too, `make_presets.py` writes its level into the preset.
"""
import argparse
import re
import subprocess
from pathlib import Path

PRESETS = Path(__file__).resolve().parent.parent
HELD_OUT = ["--hold-out", "azimuth=-85..85/10", "--seed", "1"]


def name_loft(scene):
    """Puts the content of the loft before those that projects name it by, and into the presets that play it."""
    from blake3 import blake3

    source = PRESETS.parent / "plugin" / "src" / "library" / "factory.rs"
    text, new = source.read_text(), blake3(scene.read_bytes()).hexdigest()
    known = re.search(r'LOFT_HASHES: \[&str; (\d+)\] = \[\n    "([0-9a-f]{64})"', text)
    if known[2] != new:
        source.write_text(text.replace(known[0], f'LOFT_HASHES: [&str; {int(known[1]) + 1}] = [\n    "{new}",\n    "{known[2]}"'))
        for preset in (PRESETS / "plugin").glob("*.vstpreset"):
            preset.write_bytes(preset.read_bytes().replace(known[2].encode(), new.encode()))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("iosr")
    p.add_argument("head")
    p.add_argument("--only", nargs="+")
    a = p.parse_args()
    room = lambda name: ["bake", "responses", PRESETS / "recipes" / f"{name}.json", "--root", a.iosr, *HELD_OUT]
    loft = ["simulate", PRESETS / "scenes" / "loft.obj", "--source", "1.5,0,0", "--head", a.head, "--rays", "65536", "--head-turns", "1"]
    loft += ["--waves", "105", "--gain", "-4.8"]
    scenes = {name: room(name) for name in ("iosr-room-a", "iosr-room-b")}
    scenes["loft"] = [*loft, "--seed", "1", "--title", "Loft, round a corner"]
    for name, command in scenes.items():
        if not a.only or name in a.only:
            scene = PRESETS / "scenes" / f"{name}.promenade"
            subprocess.run([a.promenade, *command, "-o", scene], check=True)
            # What less of it costs, so that nobody has to search for it.
            with_front = scene.with_suffix(".front.promenade")
            subprocess.run([a.promenade, "bake", "less", scene, "-o", with_front], check=True)
            with_front.replace(scene)
            if name == "loft":
                name_loft(scene)


if __name__ == "__main__":
    main()
