"""Writes the plugin's presets as .vstpreset files.

usage: make_presets.py Promenade.vst3 FOLDER

Needs pedalboard. The plugin's own state is the template, so a preset always has the form that the plugin writes today.
"""

import json
import struct
import sys
from pathlib import Path

import pedalboard

WALK = Path(__file__).parent.parent / "paths" / "walk.json"

# Differences from the plugin's defaults: parameters in their own units as a state keeps them, and the camera path's file.
PRESETS = {
    "Office, facing the source": {},
    "Office, at the door": {"x": -3.0, "y": -1.5, "yaw": 20.0},
    "Class room, facing the source": {"scene": "iosr-room-b"},
    "Class room, back row": {"scene": "iosr-room-b", "x": -5.0},
    "Class room, walk round the source": {"scene": "iosr-room-b", "follow": "transport", "path": WALK},
    "Half dry, source on the left": {"yaw": -60.0, "mix": 0.5},
    "Direct sound only, for head tracking on many tracks": {"tier": "draft"},
}
KINDS = {"scene": "string", "follow": "string", "tier": "string"}


def vstpreset(class_id, component):
    """Steinberg's preset file: header, the component's state, an empty controller's state, and the list of both."""
    start = 48
    end = start + len(component)
    entries = struct.pack("<4sqq", b"Comp", start, len(component)) + struct.pack("<4sqq", b"Cont", end, 0)
    return struct.pack("<4si32sq", b"VST3", 1, class_id, end) + component + b"List" + struct.pack("<i", 2) + entries


def make(template):
    """Name and content of every preset, from the content of the plugin's own state as a preset."""
    _, _, class_id, end = struct.unpack_from("<4si32sq", template)
    state = json.loads(template[48:end])
    files = {}
    for name, changes in PRESETS.items():
        preset = json.loads(json.dumps(state))
        for key, value in changes.items():
            if key == "path":
                walk = {"keyframes": json.loads(value.read_text()), "speed": 1.0, "looping": True, "slot": 0}
                preset["fields"]["walk"] = json.dumps(walk, separators=(",", ":"))
            else:
                preset["params"][key] = {KINDS.get(key, "f32"): value}
        files[f"{name}.vstpreset"] = vstpreset(class_id, json.dumps(preset, separators=(",", ":")).encode())
    return files


def main():
    bundle, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in make(pedalboard.load_plugin(bundle).preset_data).items():
        (folder / name).write_bytes(content)
        print(folder / name)


if __name__ == "__main__":
    main()
