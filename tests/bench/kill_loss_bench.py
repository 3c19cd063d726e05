#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a recording lacks after kill -9: kill_loss_bench.py BUILD [KILLS [SEED]]

BUILD has toftwind and the Python package. Each time a daemon records the test pattern (512 x 424, 30 Hz, all planes) for one to
three seconds and is killed. Lost is the time from the last frame in the file to the last that a client had. Prints each, and the
median, p95 and the longest."""
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

build, kills, seed = sys.argv[1], int((sys.argv[2:3] or ["40"])[0]), int((sys.argv[3:4] or ["1"])[0])
sys.path.insert(0, os.path.join(build, "tools/python"))
import toftwin  # noqa: E402  pylint: disable=wrong-import-position

CONFIGURATION = 'recording_folder = "r"\n[[source]]\nname = "pattern"\ndriver = "pattern"\n'


def lost_by_a_kill(folder, seconds):
    with open(os.path.join(folder, "d.toml"), "w", encoding="utf-8") as file:
        file.write(CONFIGURATION)
    socket = os.path.join(folder, "s")
    daemon = subprocess.Popen([os.path.join(build, "daemon/toftwind"), "--config", os.path.join(folder, "d.toml"), "--port", "0", "--socket", socket],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not os.path.exists(socket):
        time.sleep(0.02)
    client = toftwin.connect("unix:" + socket, timeout=60)
    last = 0
    stream = client.stream("pattern", planes=["flags"])
    path = client.start_recording("pattern", "a")
    first = stream.next(60).received_ns
    while last - first < seconds * 1e9:
        last = stream.next(60).received_ns
    daemon.send_signal(signal.SIGKILL)
    daemon.wait()
    recording = toftwin.open(path)
    assert len(recording) > 0, "a file without frames"
    written = max(frame.received_ns for frame in recording)
    return max(0.0, 1e-9 * (last - written)), os.path.getsize(path), len(recording)


draw = random.Random(seed)
losses = []
for _ in range(kills):
    with tempfile.TemporaryDirectory() as folder:
        lost, size, frames = lost_by_a_kill(folder, draw.uniform(1, 3))
        losses.append(lost)
        print(f"lost {lost:.3f} s; {frames} frames, {size / frames / 1e6:.2f} MB each", flush=True)
losses.sort()
at = lambda part: losses[min(len(losses) - 1, int(part * len(losses)))]
print(f"{kills} kills (seed {seed}, load {os.getloadavg()[0]:.0f}): p50 {at(0.5):.3f} s, p95 {at(0.95):.3f} s, most {losses[-1]:.3f} s")
