"""Plays the VST3 bundle in dawdreamer, which is JUCE's host with automation at audio rate, and checks what comes out.

usage: dawdreamer_check.py Promenade.vst3

The host reads automation at the start of each block and takes off no latency. It restores its own states through the plugin's
editor only, which wants a screen; presets, here those that pedalboard makes, need none.
"""

import sys
import tempfile
from pathlib import Path

import dawdreamer
import numpy as np
import pedalboard

PRESETS = Path(__file__).parent.parent.parent / "presets"
RATE = 48_000
SECONDS = 1.5
SAMPLES = int(SECONDS * RATE)


def noise():
    mono = np.random.default_rng(1).uniform(-0.5, 0.5, SAMPLES).astype(np.float32)
    return np.stack([mono, mono])


def level_db(signal):
    return 10 * np.log10(np.mean(np.square(signal, dtype=np.float64)) + 1e-20)


def difference_db(a, b):
    return 20 * np.log10(np.max(np.abs(a - b)) + 1e-12)


class Session:
    """An engine with a track of sound that goes through the plugin."""

    def __init__(self, path, block=512, signal=None):
        self.engine = dawdreamer.RenderEngine(RATE, block)
        self.track = self.engine.make_playback_processor("track", noise() if signal is None else signal)
        self.plugin = self.engine.make_plugin_processor("plugin", path)
        names = [p["name"] for p in self.plugin.get_parameters_description()]
        self.number = {name: index for index, name in enumerate(names)}

    def set(self, **values):
        for name, value in values.items():
            self.plugin.set_parameter(self.number[name], value)
        return self

    def automate(self, name, values):
        assert self.plugin.set_automation(self.number[name], values.astype(np.float32)), name
        return self

    def render(self):
        self.engine.load_graph([(self.track, []), (self.plugin, ["track"])])
        assert self.engine.render(SECONDS)
        out = self.engine.get_audio()
        assert out.shape == (2, SAMPLES), out.shape
        assert np.all(np.isfinite(out))
        return out


def check_sound(path):
    session = Session(path)
    assert session.number.keys() >= {"Yaw", "Listener X", "Output Gain", "Dry/Wet", "Accuracy", "Scene"}, session.number
    assert level_db(session.render()) > -60
    assert session.plugin.get_latency_samples() > 0


def check_automation(path):
    """With blocks of one sample a step of the gain comes out on its sample, later by the latency."""
    signal = np.full((2, SAMPLES), 0.25, np.float32)
    gain = np.full(SAMPLES, 60 / 72)
    gain[10_000:] = 54 / 72
    session = Session(path, 1, signal).set(**{"Dry/Wet": 0.0}).automate("Output Gain", gain)
    out = session.render()
    latency = session.plugin.get_latency_samples()
    steady = out[0, 5_000]
    changed = int(np.argmax(np.abs(out[0, 5_000:] - steady) > 1e-6)) + 5_000
    assert changed == 10_000 + latency, f"the step comes out at {changed}, the latency is {latency}"
    ratio = 20 * np.log10(out[0, -1] / steady)
    assert abs(ratio + 6) < 0.01, f"{ratio:.3f} dB"


def check_blocks(path):
    """Automation that jumps every so many times 512 samples sounds the same in all blocks that divide them; lines glide over a block."""
    steps = 0.5 + 0.3 * np.sign(np.sin(np.arange(SAMPLES) // 512 * 0.2 + 0.1))
    renderings = {block: Session(path, block).automate("Yaw", steps).render() for block in (512, 128, 32, 1)}
    still = Session(path, 512).render()
    assert difference_db(renderings[512], still) > -40, "the automation moves nothing"
    for block, out in renderings.items():
        difference = difference_db(renderings[512], out)
        assert difference < -100, f"blocks of {block}: {difference:.1f} dB"


def check_head_turn(path):
    """The factory scene's source is ahead: while the head turns from left to right, it goes from the right ear to the left."""
    session = Session(path, 32).automate("Yaw", 0.5 + np.linspace(60, -60, SAMPLES) / 360)
    out = session.render()
    third = SAMPLES // 3
    early, late = (level_db(part[0]) - level_db(part[1]) for part in (out[:, :third], out[:, -third:]))
    assert early < -1 and late > 1, f"the left ear is louder by {early:.1f} dB at first, {late:.1f} dB at last"


def check_scene(path):
    """A scene that automation chooses is heard from there on, however fast the rendering is. The host announces none: its pace tells."""
    half = SAMPLES // 2
    rooms = {name: np.full(SAMPLES, value) for name, value in (("A", 0.0), ("B", 0.5))}
    rooms["changed"] = np.concatenate([rooms["A"][:half], rooms["B"][half:]])
    before, after = slice(half // 2, half), slice(-SAMPLES // 6, None)
    found = []
    # The pace is the clock's: a machine that is busy with something else may hold up a rendering, but hardly five.
    for _ in range(5):
        out = {name: Session(path).automate("Scene", values).render() for name, values in rooms.items()}
        assert difference_db(out["A"][:, after], out["B"][:, after]) > -20, "both rooms sound the same"
        differences = [difference_db(out["changed"][:, part], out[room][:, part]) for room, part in (("A", before), ("B", after))]
        again = Session(path).automate("Scene", rooms["changed"]).render()
        found.append((*differences, difference_db(again, out["changed"])))
        if max(differences) < -40 and found[-1][2] < -120:
            return
    raise AssertionError(f"dB from room A, from room B, from another rendering, by tries: {found}")


def check_state(path):
    """What another host has saved is heard from the first sample, as it is there, and saved again as it is."""
    other = pedalboard.load_plugin(path, plugin_name="Promenade")
    other.scene = "IoSR room B"
    other.parameters["yaw_deg"].raw_value = 0.6
    other(noise()[:, :RATE // 10], RATE)
    with tempfile.TemporaryDirectory() as folder:
        preset, saved = Path(folder) / "state.vstpreset", Path(folder) / "state"
        preset.write_bytes(other.preset_data)
        # Parameters reach a plugin with the next block; a state loads its scene at once.
        other.load_preset(str(preset))
        wanted = other(noise(), RATE)
        states = []
        for _ in range(2):
            session = Session(path)
            assert session.plugin.load_vst3_preset(str(preset))
            out = session.render()
            latency = session.plugin.get_latency_samples()
            difference = difference_db(out[:, latency:], wanted[:, : SAMPLES - latency])
            assert difference < -120, f"{difference:.1f} dB from pedalboard"
            session.plugin.save_state(str(saved))
            states.append(saved.read_bytes())
        fresh = Session(path)
        fresh.plugin.save_state(str(saved))
        assert states[0] == states[1] != saved.read_bytes()
        assert difference_db(out, fresh.render()) > -60, "the other room sounds the same"


def check_preset(path):
    session = Session(path)
    assert session.plugin.load_vst3_preset(str(PRESETS / "plugin" / "Half dry, source on the left.vstpreset"))
    out = session.render()
    assert level_db(out[0]) > level_db(out[1]) + 1


def main():
    path = sys.argv[1]
    for check in (check_sound, check_automation, check_blocks, check_head_turn, check_scene, check_state, check_preset):
        check(path)
        print(f"ok {check.__name__}", flush=True)


if __name__ == "__main__":
    main()
