"""Plays the plugins of many sources in dawdreamer, which is JUCE's host, and checks what comes out.

usage: many_check.py Promenade.vst3

The host opens the first plugin of a bundle. Here it gets bundles whose list of classes, in `moduleinfo.json`, has one each.
"""

import json
import sys
import tempfile
from pathlib import Path

import dawdreamer
import numpy as np
import pedalboard

PRESETS = Path(__file__).parent.parent.parent / "presets"
RATE = 48_000
SAMPLES = RATE
PLUGINS = {"Promenade Many": (b"PromenadeSp.Many", 16), "Promenade Many 64": (b"PromenadeSp.Mn64", 64)}


def noise():
    return np.random.default_rng(1).uniform(-0.5, 0.5, SAMPLES).astype(np.float32)


def impulse():
    signal = np.zeros(SAMPLES, np.float32)
    signal[10_000] = 1
    return signal


def level_db(signal):
    return 10 * np.log10(np.mean(np.square(signal, dtype=np.float64)) + 1e-20)


def difference_db(a, b):
    return 20 * np.log10(np.max(np.abs(a - b)) + 1e-12)


def bundle_of(path, name, folder):
    """The bundle as if it had only this plugin."""
    contents = Path(folder) / name / "Promenade.vst3" / "Contents"
    (contents / "Resources").mkdir(parents=True)
    for entry in (Path(path) / "Contents").iterdir():
        if entry.name != "Resources":
            (contents / entry.name).symlink_to(entry.resolve())
    flags = {"Unicode": True, "Classes Discardable": False, "Component Non Discardable": False}
    factory = {"Vendor": "Promenade", "URL": "", "E-Mail": "", "Flags": flags}
    listed = {
        "CID": PLUGINS[name][0].hex().upper(), "Category": "Audio Module Class", "Name": name, "Vendor": "Promenade",
        "Version": "0", "SDKVersion": "VST 3.7", "Sub Categories": ["Fx", "Spatial"], "Class Flags": 0,
        "Cardinality": 2**31 - 1, "Snapshots": [],
    }
    info = {"Name": name, "Version": "0", "Factory Info": factory, "Compatibility": [], "Classes": [listed]}
    (contents / "Resources" / "moduleinfo.json").write_text(json.dumps(info))
    return str(contents.parent)


class Session:
    """An engine with a mono track for each input of the plugin; those that are not named are silent."""

    def __init__(self, path, inputs, sounds, block=512):
        self.engine = dawdreamer.RenderEngine(RATE, block)
        self.plugin = self.engine.make_plugin_processor("plugin", path)
        assert self.plugin.get_num_input_channels() == inputs, self.plugin.get_num_input_channels()
        silence = np.zeros((1, SAMPLES), np.float32)
        tracks = []
        for source in range(1, inputs + 1):
            sound = sounds[source][np.newaxis] if source in sounds else silence
            tracks.append((self.engine.make_playback_processor(f"track {source}", sound), []))
        self.graph = [*tracks, (self.plugin, [f"track {source}" for source in range(1, inputs + 1)])]
        names = [p["name"] for p in self.plugin.get_parameters_description()]
        self.number = {name: index for index, name in enumerate(names)}

    def set(self, values):
        for name, value in values.items():
            self.plugin.set_parameter(self.number[name], value)
        return self

    def automate(self, name, values):
        assert self.plugin.set_automation(self.number[name], values.astype(np.float32)), name
        return self

    def render(self):
        self.engine.load_graph(self.graph)
        assert self.engine.render(SAMPLES / RATE)
        out = self.engine.get_audio()
        assert out.shape == (2, SAMPLES), out.shape
        assert np.all(np.isfinite(out))
        return out


def check_names(path):
    names = pedalboard.VST3Plugin.get_plugin_names_for_file(path)
    assert names == ["Promenade", *PLUGINS], names


def check_parameters(path, inputs):
    numbers = Session(path, inputs, {}).number
    parts = ("Offset X", "Offset Y", "Offset Z", "Level", "Azimuth", "Elevation", "Distance")
    further = {f"Source {n} {part}" for n in range(2, inputs + 1) for part in parts}
    assert {name for name in numbers if name[:8].strip("0123456789") == "Source "} == further
    assert numbers.keys() >= {"Yaw", "Emitter Offset X", "Output Gain", "Dry/Wet", "Scene"}


def check_inputs(path, inputs):
    """Each input is heard from its own place, and all together are their sum."""
    sources = (1, 2, 3, inputs)
    alone = {source: Session(path, inputs, {source: noise()}).render() for source in sources}
    assert all(level_db(out) > -60 for out in alone.values())
    sides = {source: level_db(out[0]) - level_db(out[1]) for source, out in alone.items()}
    assert sides[2] > 1 and sides[3] < -1, f"the left ear is louder by {sides} dB"
    assert level_db(Session(path, inputs, {}).render()) < -120
    together = Session(path, inputs, {source: noise() for source in sources}).render()
    difference = difference_db(together, sum(alone.values()))
    assert difference < -100, f"{difference:.1f} dB"


def check_latency(path, inputs):
    """A dry impulse in the last input comes out at both ears after the latency."""
    session = Session(path, inputs, {inputs: impulse()}).set({"Dry/Wet": 0.0})
    out = session.render()
    peaks = np.argmax(np.abs(out), axis=1)
    assert np.all(peaks == 10_000 + session.plugin.get_latency_samples()), peaks
    assert np.all(np.abs(out[:, peaks[0]] - 1) < 1e-4)


def check_level(path, inputs):
    silent = Session(path, inputs, {inputs: noise()}).set({f"Source {inputs} Level": 0.0}).render()
    assert level_db(silent) < -120, level_db(silent)


def check_blocks(path, inputs):
    """A source that jumps every so many times 512 samples sounds the same in all blocks that divide them."""
    steps = 0.5 + 0.02 * np.sign(np.sin(np.arange(SAMPLES) // 512 * 0.2 + 0.1))
    tracks = {2: noise()}
    moved = {block: Session(path, inputs, tracks, block).automate("Source 2 Offset X", steps).render() for block in (512, 64)}
    still = Session(path, inputs, tracks).render()
    assert difference_db(moved[512], still) > -40, "the automation moves nothing"
    difference = difference_db(moved[512], moved[64])
    assert difference < -100, f"{difference:.1f} dB"


def check_preset(path, inputs):
    """A preset of Promenade's, told to be this plugin's, sets what both have."""
    content = bytearray((PRESETS / "plugin" / "Half dry, source on the left.vstpreset").read_bytes())
    name = next(name for name, (_, count) in PLUGINS.items() if count == inputs)
    content[8:40] = PLUGINS[name][0].hex().upper().encode()
    with tempfile.TemporaryDirectory() as folder:
        preset = Path(folder) / "many.vstpreset"
        preset.write_bytes(content)
        session = Session(path, inputs, {1: noise()})
        assert session.plugin.load_vst3_preset(str(preset))
        out = session.render()
    assert level_db(out[0]) > level_db(out[1]) + 1


def main():
    path = sys.argv[1]
    check_names(path)
    print("ok check_names", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, (_, inputs) in PLUGINS.items():
            bundle = bundle_of(path, name, folder)
            for check in (check_parameters, check_inputs, check_latency, check_level, check_blocks, check_preset):
                check(bundle, inputs)
                print(f"ok {check.__name__}, {name}", flush=True)


if __name__ == "__main__":
    main()
