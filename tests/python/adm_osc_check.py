"""Moves the plugin by ADM-OSC with python-osc, in pedalboard, and asks it. Run by hand: it needs the port 4002.

usage: adm_osc_check.py Promenade.vst3     (needs pedalboard, numpy and python-osc)
"""

import json
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pedalboard
from pythonosc import dispatcher, osc_server, udp_client

RATE, PORT, OUT, ANSWERS = 48_000, 4001, 4009, 4002
PRESETS = Path(__file__).resolve().parent.parent.parent / "presets"
sys.path.insert(0, str(PRESETS / "recipes"))
import make_presets  # noqa: E402  (found through the line above)


def preset(template):
    """The plugin as object 7 of ADM-OSC, listening at PORT and sending to OUT."""
    _, _, class_id, end = struct.unpack_from("<4si32sq", template)
    state = json.loads(template[48:end])
    state["params"]["osc"] = {"bool": True}
    osc = {"port": PORT, "adm": {"object": 7, "metres": 4.0}, "out": {"on": True, "host": "127.0.0.1", "port": OUT, "rate_hz": 100.0, "adm": True}}
    state["fields"]["osc"] = json.dumps(osc)
    return make_presets.vstpreset(class_id, json.dumps(state).encode(), b"")


def listen(port, heard):
    took = dispatcher.Dispatcher()
    took.set_default_handler(lambda address, *values: heard.__setitem__(address, values))
    server = osc_server.ThreadingOSCUDPServer(("127.0.0.1", port), took)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def main():
    plugin = pedalboard.load_plugin(sys.argv[1], plugin_name="Promenade")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "adm.vstpreset"
        file.write_bytes(preset(plugin.preset_data))
        plugin.load_preset(str(file))
    noise = np.random.default_rng(1).normal(0, 0.1, (2, RATE // 2)).astype(np.float32)
    answers, sent = {}, {}
    servers = [listen(ANSWERS, answers), listen(OUT, sent)]
    client = udp_client.SimpleUDPClient("127.0.0.1", PORT)

    def play(messages):
        plugin(noise, RATE)
        for address, values in messages:
            client.send_message(address, values)
        time.sleep(0.3)
        out = plugin(noise, RATE)[:, RATE // 4:]
        return 10 * np.log10(np.mean(out**2, axis=1) + 1e-20)

    ahead = play([("/adm/obj/7/aed", [0.0, 0.0, 0.375])])
    left = play([("/adm/obj/7/aed", [60.0, 0.0, 0.375])])
    right = play([("/adm/obj/7/azim", [-60.0])])
    print("levels ahead, left, right, dB:", ahead.round(1), left.round(1), right.round(1))
    assert left[0] > left[1] + 3 and right[1] > right[0] + 3 and abs(ahead[0] - ahead[1]) < 2
    half = play([("/adm/obj/*/gain", [0.5]), ("/adm/obj/3/gain", [0.0])])
    print("half the gain, dB:", (half - right).round(2))
    assert np.all(np.abs(half - right + 6.02) < 0.1)
    mute = play([("/adm/obj/7/mute", [1])])
    assert np.all(mute < half - 50)
    play([("/adm/obj/7/mute", [0]), ("/adm/lis/ypr", [30.0, 0.0, 0.0])])
    for part in ["aed", "xyz", "gain", "mute"]:
        client.send_message(f"/adm/obj/7/{part}", [])
    client.send_message("/adm/lis/ypr", [])
    time.sleep(0.5)
    print("answers:", answers)
    assert np.allclose(answers["/adm/obj/7/aed"], [-60.0, 0.0, 0.375], atol=1e-3)
    assert np.allclose(answers["/adm/obj/7/xyz"], [0.375 * np.sin(np.pi / 3), 0.1875, 0.0], atol=1e-3)
    assert np.allclose(answers["/adm/obj/7/gain"], [0.5], atol=1e-3) and answers["/adm/obj/7/mute"] == (0,)
    assert np.allclose(answers["/adm/lis/ypr"], [30.0, 0.0, 0.0], atol=1e-3)
    print("sent:", sent)
    assert np.allclose(sent["/adm/obj/7/xyz"], answers["/adm/obj/7/xyz"], atol=1e-3)
    assert np.allclose(sent["/adm/lis/ypr"], [30.0, 0.0, 0.0], atol=0.1)
    for server in servers:
        server.shutdown()
    print("ADM-OSC: in, out and answers are as told")


if __name__ == "__main__":
    main()
