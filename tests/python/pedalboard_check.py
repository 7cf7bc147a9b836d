"""Plays the VST3 bundle in pedalboard, which is JUCE's host, and checks what comes out.

usage: pedalboard_check.py Promenade.vst3
"""

import os
import re
import sys
from pathlib import Path

import numpy as np
import pedalboard

ROOT = Path(__file__).resolve().parent.parent.parent
PRESETS = ROOT / "presets"
PARAMETERS = ROOT / "docs/parameters.md"
# The places that presets play are in the library, which need not be installed here.
os.environ["PROMENADE_SCENES"] = str(PRESETS / "library")
sys.path.insert(0, str(PRESETS / "recipes"))
import make_presets  # noqa: E402  (found through the line above)

RATE = 48_000


def documented():
    """The parameters of docs/parameters.md by pedalboard's names, which end in the unit."""
    rows = [line.split(" | ") for line in PARAMETERS.read_text().splitlines() if line.startswith("| `")]
    for _, _, name, values, *_ in rows:
        unit = re.search(r" to \S+ (m|deg|Hz|dB)$", values)
        words = re.findall("[a-z0-9]+", f"{name} {unit[1] if unit else ''}".lower())
        yield "_".join(words)


def level_db(signal):
    return 10 * np.log10(np.mean(np.square(signal, dtype=np.float64)) + 1e-20)


def noise(seconds):
    mono = np.random.default_rng(1).uniform(-0.5, 0.5, int(seconds * RATE)).astype(np.float32)
    return np.stack([mono, mono])


def set_normalized(plugin, name, value):
    plugin.parameters[name].raw_value = value


def check_parameters(plugin):
    names = {name.rstrip("_") for name in plugin.parameters}
    wanted = set(documented())
    assert wanted and names == wanted, f"differ by {sorted(names ^ wanted)}"
    set_normalized(plugin, "output_gain_db", 54 / 72)
    assert abs(float(plugin.output_gain_db) + 6) < 0.1, plugin.output_gain_db
    set_normalized(plugin, "output_gain_db", 60 / 72)


def check_sound(plugin):
    out = plugin(noise(2), RATE)
    assert out.shape == (2, 2 * RATE), out.shape
    assert np.all(np.isfinite(out))
    assert level_db(out) > -60, level_db(out)


def check_head_turn(plugin):
    """The factory scene's source is ahead: a head turned to the left has it at the right ear."""
    differences = []
    for yaw_deg in (60, -60):
        set_normalized(plugin, "yaw_deg", 0.5 + yaw_deg / 360)
        out = plugin(noise(2), RATE)
        differences.append(level_db(out[0]) - level_db(out[1]))
    set_normalized(plugin, "yaw_deg", 0.5)
    left, right = differences
    assert left < -1.5 and right > 1.5, f"left ear louder by {left:.1f} dB turned left, {right:.1f} dB turned right"


def check_latency(plugin):
    """The host takes the latency off: the dry impulse comes out where it went in."""
    assert plugin.reported_latency_samples > 0
    dry_wet = next(name for name in plugin.parameters if name.startswith("dry_wet"))
    set_normalized(plugin, dry_wet, 0.0)
    signal = np.zeros((2, RATE), np.float32)
    signal[:, 10_000] = 1
    out = plugin(signal, RATE)
    peak = int(np.argmax(np.abs(out[0])))
    assert peak == 10_000, f"the impulse comes out at {peak}, {peak - 10_000} samples off"
    assert abs(out[0, peak] - 1) < 1e-4, out[0, peak]
    set_normalized(plugin, dry_wet, 1.0)


def check_repeats(plugin):
    """Two bounces are the same, whatever the blocks."""
    signal = noise(1)
    first = plugin(signal, RATE, buffer_size=8192)
    second = plugin(signal, RATE, buffer_size=441)
    difference = 20 * np.log10(np.max(np.abs(first - second)) + 1e-12)
    assert difference < -120, f"{difference:.1f} dB"


def check_state(plugin, path):
    """A restored state is heard from the first sample of the next bounce."""
    signal = noise(1)
    before = plugin(signal, RATE)
    plugin.scene = "IoSR room B"
    set_normalized(plugin, "yaw_deg", 0.6)
    # Parameters reach the plugin with the next block; a state loads its scene at once.
    plugin(noise(0.1), RATE)
    plugin.raw_state = plugin.raw_state
    room_b = plugin(signal, RATE)
    assert np.max(np.abs(room_b - before)) > 1e-3, "the other room sounds the same"
    restored = pedalboard.load_plugin(path, plugin_name="Promenade")
    restored.raw_state = plugin.raw_state
    out = restored(signal, RATE)
    difference = 20 * np.log10(np.max(np.abs(out - room_b)) + 1e-12)
    assert difference < -120, f"{difference:.1f} dB"


def check_scene(path):
    """A scene that is set as a parameter is heard from the first block, however often it is rendered."""
    signal = noise(2)
    rooms = []
    for scene in ("IoSR room A", "IoSR room B", "IoSR room B"):
        plugin = pedalboard.load_plugin(path, plugin_name="Promenade")
        plugin.scene = scene
        rooms.append(plugin(signal, RATE))
    assert np.array_equal(rooms[1], rooms[2]), "two renderings differ"
    tenth = RATE // 10
    first = np.max(np.abs(rooms[1][:, tenth : 2 * tenth] - rooms[0][:, tenth : 2 * tenth]))
    assert first > 1e-3, "the second room is not heard in the first 0.2 s"


def check_presets(path):
    """Every preset is what its recipe makes today, loads, and sounds as it says."""
    made = make_presets.make(pedalboard.load_plugin(path, plugin_name="Promenade").preset_data)
    stored = {file.name: file.read_bytes() for file in (PRESETS / "plugin").glob("*.vstpreset")}
    assert stored.keys() == made.keys(), sorted(stored.keys() ^ made.keys())
    heard = {}
    for name, content in made.items():
        assert stored[name] == content, f"{name} is not what presets/recipes/make_presets.py makes"
        plugin = pedalboard.load_plugin(path, plugin_name="Promenade")
        plugin.load_preset(str(PRESETS / "plugin" / name))
        heard[name.removesuffix(".vstpreset")] = plugin(noise(2), RATE)
    for name, out in heard.items():
        assert np.all(np.isfinite(out)) and level_db(out) > -60, name
    front, back = heard["Class room, facing the source"], heard["Class room, back row"]
    assert level_db(front) > level_db(back) + 3
    assert np.max(np.abs(heard["Office, facing the source"] - front)) > 1e-3, "the rooms sound the same"
    left = heard["Half dry, source on the left"]
    assert level_db(left[0]) > level_db(left[1]) + 1


def main():
    path = sys.argv[1]
    plugin = pedalboard.load_plugin(path, plugin_name="Promenade")
    for check in (check_parameters, check_sound, check_head_turn, check_latency, check_repeats):
        check(plugin)
        print(f"ok {check.__name__}", flush=True)
    check_state(plugin, path)
    print("ok check_state")
    check_scene(path)
    print("ok check_scene")
    check_presets(path)
    print("ok check_presets")


if __name__ == "__main__":
    main()
