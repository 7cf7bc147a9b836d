"""Cost of zita-convolver with two responses of 1 s beside the engine and the crate fft-convolver, taking turns in one run.

usage: convolver_peers.py BENCH [ROUNDS]

BENCH is the program that `cargo bench --bench render_cost -p promenade-core --no-run` builds and names. Needs g++ and Debian's
libzita-convolver-dev, and says so where they are absent. Unit: processor seconds of all threads per second of audio at 48 kHz, medians
over rounds. zita-convolver works out long partitions on threads of its own, hence all threads.
"""

import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

RATE, SECONDS, BLOCKS = 48_000, 4, (512, 128)
PROGRAM = r"""
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <sched.h>
#include <vector>
#include <zita-convolver.h>

static float noise() { return 2.0f * rand() / RAND_MAX - 1.0f; }

static double seconds()
{
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main(int, char **arguments)
{
    const int rate = atoi(arguments[1]), length = rate * atoi(arguments[2]), block = atoi(arguments[3]);
    std::vector<float> response(rate), input(length);
    for (int i = 0; i < rate; i++) response[i] = noise() * std::pow(10.0f, -3.0f * i / rate);
    for (float &sample : input) sample = noise();
    Convproc convolver;
    if (convolver.configure(1, 2, rate, block, block, Convproc::MAXPART, 0.0f)) return 1;
    for (int ear = 0; ear < 2; ear++)
        if (convolver.impdata_create(0, ear, 1, response.data(), 0, rate)) return 2;
    if (convolver.start_process(0, SCHED_OTHER)) return 3;
    float sum = 0;
    const double began = seconds();
    for (int at = 0; at + block <= length; at += block) {
        std::copy_n(&input[at], block, convolver.inpdata(0));
        convolver.process(true);
        sum += convolver.outdata(0)[0] + convolver.outdata(1)[0];
    }
    const double taken = seconds() - began;
    convolver.stop_process();
    std::printf("%.6f %g\n", taken * rate / length, sum);
}
"""


def built(folder):
    """The program, or why there is none."""
    source, program = folder / "zita.cpp", folder / "zita"
    source.write_text(PROGRAM)
    try:
        done = subprocess.run(
            ["g++", "-O3", "-march=native", source, "-o", program, "-lzita-convolver", "-lfftw3f", "-lpthread"],
            capture_output=True,
            text=True,
        )
    except FileNotFoundError:
        return None, "g++ is absent"
    if done.returncode == 0:
        return program, None
    return None, next(line for line in done.stderr.splitlines() if "error" in line)


def of_bench(program):
    """Rows of the Rust program: block, engine, processor seconds per second."""
    out = subprocess.run([program, "--bench"], capture_output=True, text=True, check=True).stdout
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in out.splitlines() if line.startswith("|")]
    return {(int(block), name): float(cost) for block, name, cost in rows if block.isdigit()}


def main():
    bench, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5
    with tempfile.TemporaryDirectory() as folder:
        zita, why = built(Path(folder))
        if why:
            print(f"zita-convolver: skipped, {why}")
        found = {}
        for _ in range(rounds):
            costs = of_bench(bench)
            for block in BLOCKS if zita else ():
                said = subprocess.run([zita, *map(str, (RATE, SECONDS, block))], capture_output=True, text=True, check=True)
                costs[block, "zita-convolver, 2 ears of 1 s, standing still"] = float(said.stdout.split()[0])
            for key, cost in costs.items():
                found.setdefault(key, []).append(cost)
    print("| block | engine | processor s per s | least | most |\n|---:|---|---:|---:|---:|")
    for (block, name), costs in sorted(found.items(), key=lambda row: (-row[0][0], row[0][1])):
        print(f"| {block} | {name} | {statistics.median(costs):.5f} | {min(costs):.5f} | {max(costs):.5f} |")


if __name__ == "__main__":
    main()
