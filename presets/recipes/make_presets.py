"""Writes the plugin's presets as .vstpreset files.

usage: make_presets.py Promenade.vst3 FOLDER

Needs pedalboard. The plugin's own state is the template, so a preset always has the form that the plugin writes today. Presets in FOLDER
that are none of these any more are removed.
"""

import json
import math
import struct
import sys
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pedalboard

PATHS = Path(__file__).parent.parent / "paths"
# Where the library's places have their emitters, metres: as in library.py.
EMITTERS = {
    "cathedral": (54.0, 9.0),
    "club": (14.0, 5.5),
    "concert-hall": (37.5, 10.0),
    "corridor": (3.0, 1.0),
    "courtyard": (8.0, 7.0),
    "dry-studio": (3.6, 2.2),
    "l-shaped-loft": (2.4, 7.6),
    "living-room": (4.9, 2.0),
    "parking-deck": (12.0, 14.0),
    "stairwell": (1.0, 0.9),
    "street": (22.0, 4.0),
}


def yaw_to(place, x, y):
    """The turn of a head at a point that faces the place's emitter, degrees."""
    to_x, to_y = EMITTERS[place]
    return round(math.degrees(math.atan2(to_y - y, to_x - x)), 1)


def at(place, x, y, z=1.5, turned=0.0, **more):
    """A listener in a place of the library, turned to the left of its emitter by some degrees."""
    yaw = (yaw_to(place, x, y) + turned + 180.0) % 360.0 - 180.0
    return {"library": place, "x": x, "y": y, "z": z, "yaw": round(yaw, 1), **more}


def walk(place, *points, z=1.5):
    """A walk in a place of the library with the host's transport: (seconds, x, y), each facing the next, the last facing the emitter."""
    keyframes = []
    for (t, x, y), (_, to_x, to_y) in zip(points, [*points[1:], (0.0, *EMITTERS[place])]):
        yaw = round(math.degrees(math.atan2(to_y - y, to_x - x)), 1)
        keyframes.append({"t": t, "position": [x, y, z], "ypr": [yaw, 0.0, 0.0]})
    return {"library": place, "follow": "transport", "path": keyframes}


def still(*points):
    """Keyframes of a source that looks ahead: (seconds, x, y)."""
    return [{"t": t, "position": [x, y, 0.0], "ypr": [0.0, 0.0, 0.0]} for t, x, y in points]


# Name: what it is for, a sentence, and differences from the plugin's defaults: parameters in their own units as a state keeps them, a place
# of the library, and the keyframes of a camera path.
PRESETS = {
    "Office, facing the source": (
        ["speech"], "A voice 1.5 m ahead in a small, dry office.", {}),
    "Office, at the door": (
        ["speech", "film"], "The same voice from the door, 4.7 m away and a little to the side.", {"x": -3.0, "y": -1.5, "yaw": 20.0}),
    "Class room, facing the source": (
        ["speech"], "A teacher 1.5 m ahead in a live class room.", {"scene": "iosr-room-b"}),
    "Class room, back row": (
        ["speech", "film"], "The teacher heard from the back row, with more room than voice.", {"scene": "iosr-room-b", "x": -5.0}),
    "Living room, across the table": (
        ["speech", "film"], "A conversation across the table between hard walls and a curtain.", at("living-room", 3.0, 2.4)),
    "Dry studio, beside the player": (
        ["music", "speech"], "Close and almost without a room: a player at arm's length on your right.", at("dry-studio", 2.6, 2.6, turned=60.0)),
    "Club, in front of the stage": (
        ["music"], "Four metres from the stage of a club with brick walls.", at("club", 10.0, 5.0)),
    "Club, at the bar": (
        ["music", "film"], "The same stage from the far corner, half turned away.", at("club", 2.0, 2.0, turned=-70.0)),
    "Concert hall, tenth row": (
        ["music"], "Twelve metres from the soloist in a hall of 2.3 s.", at("concert-hall", 25.5, 11.0, z=2.0)),
    "Concert hall, last row": (
        ["music"], "Thirty-four metres away, where the hall is louder than the soloist.", at("concert-hall", 4.0, 8.0, z=2.0)),
    "Cathedral, in the nave": (
        ["music", "film"], "A voice at the altar, heard half way down a nave that rings for eight seconds.", at("cathedral", 30.0, 10.0)),
    "Half dry, source on the left": (
        ["music"], "A track moved 60 degrees to the left in the office, half of it as it was.", {"yaw": -60.0, "mix": 0.5}),
    "Street, on the other side": (
        ["film"], "Somebody calls from across a street between tall houses.", at("street", 30.0, 10.5, turned=25.0)),
    "Courtyard, far corner": (
        ["film"], "Steps and voices in a courtyard, from its far corner.", at("courtyard", 21.0, 15.0)),
    "Stairwell, behind you": (
        ["film"], "A voice behind you in a stairwell of bare plaster.", at("stairwell", 4.2, 2.2, turned=180.0)),
    "Parking deck, from afar": (
        ["film"], "A car door 27 m away under a low concrete deck.", at("parking-deck", 36.0, 26.0)),
    "Loft, round the corner": (
        ["film", "speech"], "A radio in the other wing of an L-shaped loft, out of sight.", at("l-shaped-loft", 10.5, 1.5)),
    "Class room, walk round the source": (
        ["walk"], "A walk round the source with the host's transport, 24.7 s, again and again.",
        {"scene": "iosr-room-b", "follow": "transport", "path": json.loads((PATHS / "walk.json").read_text())}),
    "Corridor, walk to the source": (
        ["walk", "film"], "Twenty seconds along a corridor to its source and past it, with the host's transport.",
        walk("corridor", (0.0, 24.0, 1.2), (15.0, 5.0, 1.4), (17.0, 3.0, 1.6), (20.0, 1.2, 1.0))),
    "Loft, walk round the corner": (
        ["walk", "film"], "From one wing of a loft round the corner to the source in the other, with the host's transport.",
        walk("l-shaped-loft", (0.0, 10.5, 2.0), (6.0, 4.6, 2.4), (9.0, 2.6, 4.4), (13.0, 2.5, 6.4))),
    "Loft, a voice walks past": (
        ["walk", "film"], "A voice that comes past you and goes round the corner, with the host's transport, again and again.",
        {"loft": True, "follow": "transport", "source path": still(
            (0.0, 0.6, 1.8), (4.0, 1.4, 0.0), (8.0, 0.2, -1.9), (12.0, -3.4, -1.6), (18.0, -3.8, -7.0), (24.0, -3.4, -1.0), (28.0, 0.6, 1.8))}),
    "Direct sound only, for head tracking on many tracks": (
        ["walk"], "The direct sound without the room: for a head tracker on many tracks at once.", {"early": -60.0, "late": -60.0}),
}
KINDS = {"scene": "string", "follow": "string"}


def about(name, uses, sentence):
    """What the file says of itself, as hosts write it."""
    attributes = {
        "MediaType": "VstPreset", "PlugInName": "Promenade", "PlugInVendor": "Promenade", "PlugInCategory": "Fx|Spatial",
        "MediaLibraryManufacturerName": "Promenade", "MediaLibraryName": "Promenade Factory", "Name": name,
        "MusicalStyle": "|".join(uses), "Comment": sentence,
    }
    rows = "".join(f'\t<Attribute id="{key}" value={quoteattr(value)} type="string" flags=""/>\n' for key, value in attributes.items())
    return f'<?xml version="1.0" encoding="utf-8"?>\n<MetaInfo>\n{rows}</MetaInfo>\n'.encode()


def vstpreset(class_id, component, info):
    """Steinberg's preset file: header, the component's state, an empty controller's state, what the file says of itself, and the list."""
    parts, start, entries = [(b"Comp", component), (b"Cont", b""), (b"Info", info)], 48, b""
    for key, content in parts:
        entries += struct.pack("<4sqq", key, start, len(content))
        start += len(content)
    header = struct.pack("<4si32sq", b"VST3", 1, class_id, start)
    return header + b"".join(content for _, content in parts) + b"List" + struct.pack("<i", len(parts)) + entries


def make(template):
    """Name and content of every preset, from the content of the plugin's own state as a preset."""
    _, _, class_id, list_at = struct.unpack_from("<4si32sq", template)
    (count,) = struct.unpack_from("<i", template, list_at + 4)
    parts = (struct.unpack_from("<4sqq", template, list_at + 8 + 20 * n) for n in range(count))
    state = next(json.loads(template[at:at + length]) for key, at, length in parts if key == b"Comp")
    # Headphones belong to the listener, budget and accuracy to the machine, the latency to the work, and the rest to the project: a preset
    # leaves them as they are.
    for field in ("headphones", "budget", "walks", "slots", "project", "leader", "sources"):
        state["fields"].pop(field, None)
    del state["params"]["latency"], state["params"]["accuracy"]
    files = {}
    for name, (uses, sentence, changes) in PRESETS.items():
        preset = json.loads(json.dumps(state))
        # A new instance plays the loft as its own scene; presets name what they play.
        preset["params"]["scene"], preset["fields"]["scene"] = {"string": "iosr-room-a"}, "{}"
        for key, value in changes.items():
            if key in ("path", "source path"):
                walk = {"keyframes": value, "speed": 1.0, "looping": True, "slot": 0}
                field, walk = ("walk", walk) if key == "path" else ("walks", {"1": walk})
                preset["fields"][field] = json.dumps(walk, separators=(",", ":"))
            elif key == "loft":
                # A new instance plays the one that is built in.
                preset["params"]["scene"], preset["fields"]["scene"] = state["params"]["scene"], state["fields"]["scene"]
            elif key == "library":
                # By its file's name, so that a place that is made again is still found.
                scene = {"hash": "", "title": value, "absolute": f"{value}.promenade", "from_home": "", "slot": 0}
                preset["fields"]["scene"] = json.dumps(scene, separators=(",", ":"))
                preset["params"]["scene"] = {"string": "library"}
            else:
                preset["params"][key] = {KINDS.get(key, "f32"): value}
        component = json.dumps(preset, separators=(",", ":")).encode()
        files[f"{name}.vstpreset"] = vstpreset(class_id, component, about(name, uses, sentence))
    return files


def main():
    bundle, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    files = make(pedalboard.load_plugin(bundle, plugin_name="Promenade").preset_data)
    for old in folder.glob("*.vstpreset"):
        if old.name not in files:
            old.unlink()
    for name, content in files.items():
        (folder / name).write_bytes(content)
        print(folder / name)


if __name__ == "__main__":
    main()
