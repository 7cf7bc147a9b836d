"""Measures how late the standalone program is on JACK: a client sends a click through it and listens to what comes back.

usage: xvfb-run -a python3 jack_round_trip.py promenade-standalone [PERIOD]

Starts a JACK server of its own on the dummy sound card and plays the scene with which the program begins. For each latency it
prints when the click comes back at the left and right ear, and when the client hears itself, in samples after it was sent.
"""

import os
import subprocess
import sys
import time
from collections import Counter

import jack
import numpy as np

RATE = 48_000
SERVER = "promenade-round-trip"
CLICKS = 9


class Listener:
    """A client whose only output goes to the program, and whose inputs hear both ears and the client itself."""

    def __init__(self):
        self.client = jack.Client("click", servername=SERVER, no_start_server=True)
        self.click = self.client.outports.register("click")
        self.ears = [self.client.inports.register(name) for name in ("left", "right", "itself")]
        self.heard, self.at = [], 0
        self.client.set_process_callback(self.process)
        self.client.activate()
        self.client.connect(self.click, self.ears[2])

    def process(self, frames):
        out = self.click.get_array()
        out[:] = 0
        if self.at % RATE < frames:
            out[0] = 1
        self.heard.append((self.at, [ear.get_array().copy() for ear in self.ears]))
        self.at += frames

    def connect(self):
        """Waits for the program's ports and connects them."""
        for _ in range(300):
            time.sleep(0.1)
            ports = self.client.get_ports(is_audio=True)
            theirs = [port for port in ports if not port.name.startswith(("click:", "system:"))]
            inputs, outputs = [port for port in theirs if port.is_input], [port for port in theirs if port.is_output]
            try:
                for pair in [*((self.click, port) for port in inputs), *zip(outputs, self.ears)]:
                    if pair[1] not in self.client.get_all_connections(pair[0]):
                        self.client.connect(*pair)
            except jack.JackErrorCode:
                # Ports are there before the program plays.
                continue
            if len(inputs) == 2 and len(outputs) == 2:
                return
        raise SystemExit("the program has no two inputs and outputs on JACK")

    def clicks(self):
        """Peaks and first sounds after each click of one second, as samples from it."""
        time.sleep(3)
        self.heard = []
        time.sleep(CLICKS + 2)
        blocks = list(self.heard)
        at = blocks[0][0]
        sound = np.concatenate([np.array(block) for _, block in blocks], axis=1)
        period = blocks[1][0] - blocks[0][0]
        found = []
        first = -(-at // RATE) * RATE
        for sent in range(first, first + CLICKS * RATE, RATE):
            # The first block at or after each second has it on its first sample.
            sent = -(-sent // period) * period
            part = np.abs(sound[:, sent - at : sent - at + RATE - 4096])
            peaks = part.argmax(axis=1)
            begins = [int(np.argmax(ear > 0.05 * ear.max())) for ear in part]
            found.append((tuple(map(int, peaks)), tuple(begins)))
        return found


def measure(program, latency):
    """The program in a process of its own, for one latency."""
    listener = Listener()
    command = [program, "--backend", "jack", "--latency", latency]
    environment = dict(os.environ, JACK_DEFAULT_SERVER=SERVER)
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        listener.connect()
        # A period that the server skips puts the clicks around it out of time.
        (peaks, begins), count = Counter(listener.clicks()).most_common(1)[0]
        print(f"{latency}: peaks at {peaks}, first above a 20th of them at {begins}, {count} of {CLICKS} clicks", flush=True)
    finally:
        process.terminate()
        process.wait()
        listener.client.deactivate()
        listener.client.close()


def main():
    program = os.path.abspath(sys.argv[1])
    period = sys.argv[2] if len(sys.argv) > 2 else "64"
    server = subprocess.Popen(
        ["jackd", "-n", SERVER, "-r", "-d", "dummy", "-r", str(RATE), "-p", period],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        time.sleep(2)
        for latency in ("frame", "64", "none"):
            measure(program, latency)
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
