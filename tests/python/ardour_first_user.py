"""What a first-time user does in Ardour, without a screen: every step with its clicks, and a bounce that is listened to.

usage: ardour_first_user.py Promenade.vst3 [PRESETS]

Needs Ardour 7 (Debian: ardour). One session plays noise through a preset whose source moves, and is bounced; the voice has to pass from the
left ear to the right. Another has twelve named tracks at the inputs of Promenade Many, which are heard together.
"""

import array
import math
import os
import shutil
import subprocess
import sys
import tempfile
import wave
from pathlib import Path

ARDOUR = Path("/usr/lib/ardour7")
TICKS_PER_S = 282_240_000
# Seconds of the bounces.
WALK_S, ROOM_S = 12, 6
# What is clicked for each step of Ardour 7.3, beside the keys that are named.
WALK = {
    "New session: Open": 1,
    "Ctrl+I: a sound, Import": 2,
    "Mixer strip, New plugin, Promenade": 3,
    "In its editor the preset's name, Loft, a voice walks past": 2,
    "Alt+E: Export": 1,
}
ROOM = {
    "New session: Open": 1,
    "Ctrl+I: twelve sounds, Import: tracks with their names": 2,
    "Ctrl+Shift+N: Bus, Add": 2,
    "Mixer strip, New plugin, Promenade Many": 3,
    "Pin connections, Add sidechain": 2,
    "Side chain: a cross in the grid for each further track": 11,
    "The first track's output to the bus": 2,
    "Alt+E: Export": 1,
}
COMMON = """
AudioEngine:set_backend("None (Dummy)", "", "")
local s = create_session(os.getenv("HOME") .. "/NAME", "NAME", 48000)
local function track(name)
  local t = s:new_audio_track(1, 2, nil, 1, name, ARDOUR.PresentationInfo.max_order, ARDOUR.TrackMode.Normal, true):front()
  t:add_processor_by_index(ARDOUR.LuaAPI.new_luaproc(s, "ACE Noise"), -1, nil, true)
  return t
end
local function insert(route, name)
  local p = ARDOUR.LuaAPI.new_plugin(s, name, ARDOUR.PluginType.VST3, "")
  assert(p and not p:isnil(), name .. " is not found")
  assert(route:add_processor_by_index(p, -1, nil, true) == 0, name .. " does not fit")
  return p
end
"""
SCRIPTS = {
    "walk": """
local voice = track("Voice")
local plugin = insert(voice, "Promenade"):to_insert():plugin(0)
assert(plugin:load_preset(plugin:preset_by_label("Loft, a voice walks past")), "no preset")
assert(voice:n_outputs():n_audio() == 2, "the track has one output")
""",
    "room": """
local bus = s:new_audio_route(1, 2, nil, 1, "Room", ARDOUR.PresentationInfo.Flag.AudioBus, ARDOUR.PresentationInfo.max_order):front()
local many = insert(bus, "Promenade Many")
assert(bus:add_sidechain(many), "no side chain")
local further = many:to_insert():sidechain_input()
assert(further:n_ports():n_audio() == 15, "inputs are missing")
for n, name in ipairs({"Kick", "Snare", "Hat", "Bass", "Guitar", "Piano", "Organ", "Horns", "Strings", "Choir", "Lead", "Voice"}) do
  local t = track(name)
  t:output():disconnect_all(nil)
  local port = n == 1 and bus:input():audio(0) or further:audio(n - 2)
  assert(t:output():audio(0):connect(port:name()) == 0, name .. " is not connected")
end
""",
}


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True, timeout=400).stdout


def bounced(home, name, seconds):
    """Makes a session, gives it a length, and exports it: left and right ear, 16-bit numbers."""
    script = home / f"{name}.lua"
    script.write_text(COMMON.replace("NAME", name) + SCRIPTS[name] + '\ns:save_state("")\nclose_session()\nquit()\n')
    said = run(ARDOUR / "luasession", script)
    if "Error:" in said:
        sys.exit(said[said.index("Error:"):].splitlines()[0])
    session = home / name / f"{name}.ardour"
    length = f'<Location id="99999" name="session" start="a0" end="a{seconds * TICKS_PER_S}" flags="IsSessionRange"/>'
    session.write_text(session.read_text().replace("<Locations/>", f"<Locations>{length}</Locations>"))
    out = home / f"{name}.wav"
    run("ardour7-export", "-o", out, home / name, name)
    with wave.open(str(out)) as sound:
        samples = array.array("h", sound.readframes(sound.getnframes()))
    return samples[0::2], samples[1::2]


def level_db(samples):
    return 10 * math.log10(1e-9 + sum((x / 32768) ** 2 for x in samples) / max(1, len(samples)))


def main():
    bundle = Path(sys.argv[1]).resolve()
    presets = Path(sys.argv[2] if len(sys.argv) > 2 else Path(__file__).parents[2] / "presets/plugin")
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        data, config = "/usr/share/ardour7", "/etc/ardour7"
        os.environ |= {"HOME": folder, "LD_LIBRARY_PATH": str(ARDOUR), "ARDOUR_DATA_PATH": data, "ARDOUR_CONFIG_PATH": config,
                       "ARDOUR_DLL_PATH": str(ARDOUR), "VAMP_PATH": str(ARDOUR / "vamp")}
        shutil.copytree(bundle, home / ".vst3" / bundle.name)
        shutil.copytree(presets, home / ".vst3/presets/Promenade/Promenade")
        run(ARDOUR / "ardour-vst3-scanner", "-f", home / ".vst3" / bundle.name)
        # Without a screen Ardour takes only what was scanned after the plugin was installed, in whole seconds.
        for cache in (home / ".cache/ardour7/vst").iterdir():
            os.utime(cache, (cache.stat().st_mtime + 2,) * 2)
        left, right = bounced(home, "walk", WALK_S)
        second = len(left) // WALK_S
        aside = [level_db(left[at:at + second]) - level_db(right[at:at + second]) for at in (0, 7 * second)]
        print(f"walk: left over right {aside[0]:+.1f} dB at first, {aside[1]:+.1f} dB at 7 s; {sum(WALK.values())} clicks")
        if not aside[0] > 2 > -2 > aside[1]:
            sys.exit("the voice does not pass from the left to the right")
        left, right = bounced(home, "room", ROOM_S)
        print(f"room: {level_db(left):.1f} and {level_db(right):.1f} dB; {sum(ROOM.values())} clicks")
        if min(level_db(left), level_db(right)) < -60:
            sys.exit("nothing is heard of twelve tracks")
    for name, steps in {"Moving source": WALK, "Twelve tracks": ROOM}.items():
        print(f"\n{name}")
        for step, clicks in steps.items():
            print(f"{clicks:3}  {step}")


if __name__ == "__main__":
    main()
