#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Frames a second of the Python client beside the C++ client's: python_bench.py BUILD [ROUNDS [SECONDS]]

BUILD has toftwind, the Python package and clients_bench (preset bench). Both clients take the test pattern (512 x 424, as fast as it
comes) over the Unix socket, in turn, so that what else the machine does meets both. Prints each round, and the median of the
rounds' ratios."""
import os
import statistics
import subprocess
import sys
import tempfile
import time

build, rounds, seconds = sys.argv[1], int((sys.argv[2:3] or ["9"])[0]), int((sys.argv[3:4] or ["5"])[0])
sys.path.insert(0, os.path.join(build, "tools/python"))
import toftwin  # noqa: E402  pylint: disable=wrong-import-position

CONFIGURATION = """
[[source]]
name = "pattern"
driver = "pattern"
pace = "fast"
planes = ["range", "amplitude", "flags"]
"""


def of_python(address):
    frames, end = 0, time.monotonic() + seconds
    with toftwin.connect(address) as client, client.stream("pattern") as stream:
        for frame in stream:
            assert frame["range"].shape == (424, 512) and frame["amplitude"][0, 0] >= 0
            frames += 1
            if time.monotonic() >= end:
                return frames / seconds


def of_cpp(address):
    said = subprocess.run([os.path.join(build, "tests/bench/clients_bench"), address, "pattern", "1", str(seconds)], check=True,
                          capture_output=True, text=True).stdout
    return float(said.split()[0])


with tempfile.TemporaryDirectory() as folder:
    with open(os.path.join(folder, "d.toml"), "w", encoding="utf-8") as file:
        file.write(CONFIGURATION)
    address = f"unix:{folder}/s"
    daemon = subprocess.Popen([os.path.join(build, "daemon/toftwind"), "--config", f"{folder}/d.toml", "--port", "0", "--socket", address[5:]],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not os.path.exists(address[5:]):
            time.sleep(0.05)
        ratios = []
        for _ in range(rounds):
            cpp, python = of_cpp(address), of_python(address)
            ratios.append(python / cpp)
            print(f"C++ {cpp:.0f} frames/s, Python {python:.0f} frames/s, ratio {ratios[-1]:.3f}", flush=True)
        print(f"median ratio {statistics.median(ratios):.3f}")
    finally:
        daemon.terminate()
        daemon.wait()
