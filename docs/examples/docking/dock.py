#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A mobile robot docks at a pallet that it sees through an ifm O3D303.

The controller knows the camera's own language (PCIC) and nothing of toftwin. Only where the robot stands is told to the
simulated camera, over Modbus TCP: that is the world's part, not the controller's. Every step is: stand, trigger, look,
drive. Python's standard library is enough.

    toftwind docs/examples/docking/toftwind.toml &
    docs/examples/docking/dock.py
"""
import argparse
import json
import math
import random
import socket
import statistics
import struct
import sys
import time

STOP_M = 0.45            # the lens stands so far before the pallet's front when it is docked
BAND_M = (-0.225, -0.13)  # of the blocks' fronts above the lens, without the floor and the deck
WIDTH_M, BLOCK_M, GAP_M = 0.8, 0.145, 0.28  # of the pallet, of its widest block, wider than its pockets
ON_LINE_M = 0.012        # three times the noise of a point
BORDER_PX = 3            # an end so near to the image's is none: the pallet goes on outside
STEP_S, SPEED_M_S, TURN_RAD_S = 0.2, 0.35, 0.5
CLOSE_M = 0.001          # so near to where it shall stop the robot stays
TRUST = 0.2              # in a single look, against what the wheels say


def receive(line, count):
    data = bytearray()
    while len(data) < count:
        part = line.recv(count - len(data))
        if not part:
            raise SystemExit("dock: the other side closed the connection")
        data += part
    return bytes(data)


class Camera:
    """Triggers frames and takes their point images: PCIC, protocol version 3."""

    # The camera's X is right, its Y down and its Z ahead.
    IMAGES = {200: "right", 201: "down", 202: "ahead", 300: "confidence"}

    def __init__(self, host, port):
        self.line = socket.create_connection((host, port), timeout=30)

    def frame(self):
        """Points in metres, x ahead, y to the left, z up: (x, y, z, columns to the image's border) of valid pixels."""
        self.line.sendall(b"1000L000000007\r\n1000t\r\n")
        while True:
            size = int(receive(self.line, 16)[5:14])
            message = receive(self.line, size)
            if message[:4] == b"1000" and message[4:5] != b"*":
                raise SystemExit(f"dock: the camera took no trigger: {message[4:-2].decode(errors='replace')}")
            if message[:4] == b"0000":
                return self.points(message[4:])

    def points(self, content):
        if content[:4] != b"star":
            raise SystemExit("dock: what came is no frame")
        images, at = {}, 4
        while at + 24 <= len(content) and content[at:at + 4] != b"stop":
            kind, size, header, _, columns, rows = struct.unpack_from("<6I", content, at)
            if kind in self.IMAGES:
                form, width = "B" if kind == 300 else "h", columns
                images[self.IMAGES[kind]] = struct.unpack_from(f"<{columns * rows}{form}", content, at + header)
            at += max(size, 24)
        every = zip(images["ahead"], images["right"], images["down"], images["confidence"])
        return [(ahead / 1000, -right / 1000, -down / 1000, min(i % width, width - 1 - i % width))
                for i, (ahead, right, down, confidence) in enumerate(every) if not confidence & 1]


class World:
    """Where the robot stands, told to the simulated camera over Modbus TCP."""

    def __init__(self, host, port):
        self.line = socket.create_connection((host, port), timeout=30)

    def ask(self, function, rest):
        self.line.sendall(struct.pack(">HHHBB", 0, 0, 2 + len(rest), 1, function) + rest)
        answer = receive(self.line, struct.unpack(">H", receive(self.line, 6)[4:6])[0])
        if answer[1] != function:
            raise SystemExit(f"dock: Modbus function {function} was refused with exception {answer[2]}")
        return answer[2:]

    def stand(self, x, z, heading):
        pose = struct.pack(">6f", x, 0.0, z, 0.0, math.degrees(heading), 0.0)  # y down, heading about it
        self.ask(16, struct.pack(">HHB", 10, 12, len(pose)) + pose)
        self.ask(5, struct.pack(">HH", 3, 0xFF00))
        while self.ask(1, struct.pack(">HH", 3, 1))[1] & 1:
            time.sleep(0.001)
        result = struct.unpack(">H", self.ask(4, struct.pack(">HH", 3, 1))[1:3])[0]
        if result:
            raise SystemExit(f"dock: the camera could not be put there: result {result}")


def least_squares(points):
    """x = a + b y: (a, b)."""
    n = len(points)
    mean_x, mean_y = sum(p[0] for p in points) / n, sum(p[1] for p in points) / n
    b = sum((p[0] - mean_x) * (p[1] - mean_y) for p in points) / sum((p[1] - mean_y) ** 2 for p in points)
    return mean_x - b * mean_y, b


def fit_line(points):
    """x = a + b y and the points on it. Of lines through two points the one from which the squared distances, none
    counted as more than ON_LINE_M, are least; then least squares. To count the points within ON_LINE_M alone would tilt
    the line towards a pocket's side, where some lie by chance."""
    if len(points) < 20:
        return None
    chance, some = random.Random(1), points[::max(1, len(points) // 400)]
    best, least = None, math.inf
    for _ in range(80):
        (x1, y1, *_), (x2, y2, *_) = chance.sample(some, 2)
        if abs(y2 - y1) < 0.05 or abs(x2 - x1) > abs(y2 - y1):
            continue
        b = (x2 - x1) / (y2 - y1)
        cost = sum(min((p[0] - x1 - b * (p[1] - y1)) ** 2, ON_LINE_M ** 2) for p in some)
        if cost < least:
            best, least = (x1 - b * y1, b), cost
    for _ in range(4):
        if best is None:
            return None
        kept = [p for p in points if abs(p[0] - best[0] - best[1] * p[1]) < ON_LINE_M]
        best = least_squares(kept) if len(kept) >= 20 else None
    return None if best is None else (*best, kept)


def widest_group(points):
    """The most points beside each other: what stands more than a pocket's width aside is something else."""
    groups, last = [], None
    for point in sorted(points, key=lambda p: p[1]):
        if last is None or point[1] - last > GAP_M:
            groups.append([])
        groups[-1].append(point)
        last = point[1]
    return max(groups, key=len, default=[])


def find_pallet(points, near):
    """The pallet's front about `near` ahead: how far the robot is from it, how far its middle is to the left of the way
    (None where an end is out of sight), and how far the robot is turned to the right against the pallet's axis (None
    where a single block is in sight: too short to tell)."""
    front = [p for p in points if BAND_M[0] < p[2] < BAND_M[1] and abs(p[0] - near) < 0.1 + 0.1 * abs(p[1])]
    line = fit_line(front)
    if line is None:
        return None
    a, b, kept = line
    along = widest_group(kept)
    (_, right, _, right_px), (_, left, _, left_px) = along[0], along[-1]
    is_whole = min(right_px, left_px) >= BORDER_PX and abs(math.hypot(1, b) * (left - right) - WIDTH_M) < 0.04
    is_long = left - right > 1.5 * BLOCK_M
    return a / math.hypot(1, b), (right + left) / 2 if is_whole else None, -math.atan(b) if is_long else None


def dock(camera, world, x, z, heading, steps=80):
    """Drives from (x, z, heading) until the camera says that the robot is there. The pallet's front is z = 0."""
    way, waits, near, middle, turned, trust = [(x, z, heading)], [], None, None, 0.0, 1.0
    for _ in range(steps):
        begun = time.monotonic()
        world.stand(x, z, heading)
        points = camera.frame()
        waits.append(time.monotonic() - begun)
        if near is None:  # the first look: the nearest thing at the blocks' height that has some width
            ahead = sorted(p[0] for p in points if BAND_M[0] < p[2] < BAND_M[1] and abs(p[1]) < 0.5)
            if not ahead:
                break
            near = ahead[len(ahead) // 10]
        seen = find_pallet(points, near)
        if seen is None:
            break
        near_seen, middle_seen, turned_seen = seen
        # Where the pallet is for the robot: its front ahead, its middle to the left; and how far the robot is turned
        # to the right against its axis. Each look corrects a part of what the wheels say.
        near += (near_seen - near) * trust
        if turned_seen is not None:
            turned += (turned_seen - turned) * trust
        if middle_seen is not None:
            middle = middle_seen if middle is None else middle + (middle_seen - middle) * trust
        trust = TRUST
        if near - STOP_M < CLOSE_M:
            return way, waits, True
        # To the right of the axis; heading against it that is wanted.
        aside = 0.0 if middle is None else (middle - near * math.sin(turned)) / math.cos(turned)
        wanted = max(-0.35, min(0.35, -1.5 * aside / max(near - STOP_M, 0.3)))
        turn = max(-TURN_RAD_S, min(TURN_RAD_S, 2.0 * (wanted - turned))) * STEP_S
        go = min(SPEED_M_S * STEP_S, 0.5 * (near - STOP_M))
        heading += turn
        x += go * math.sin(heading)
        z += go * math.cos(heading)
        way.append((x, z, heading))
        turned += turn
        near -= go * math.cos(turned)
        if middle is not None:
            middle = (aside + go * math.sin(turned)) * math.cos(turned) + near * math.sin(turned)
    return way, waits, False


def draw(results, file):
    """The ways from above, four times as wide as they are."""
    colors = {"ideal": "#1a7f5a", "real": "#c2452d"}
    lines = ['<rect x="227.5" y="30" width="145" height="14" fill="#b08a5a"/>',
             '<text x="380" y="42" fill="#666">middle block of the pallet</text>']
    lines.append('<path d="M300 44V560" stroke="#888" stroke-dasharray="4 4"/>')
    lines.append(f'<path d="M60 {44 + 250 * STOP_M:.0f}H540" stroke="#888" stroke-dasharray="1 5"/>')
    for name, runs in results.items():
        for run in runs:
            points = " ".join(f"{300 + 1000 * x:.1f},{44 - 250 * z:.1f}" for x, z, _ in run["way"])
            lines.append(f'<polyline points="{points}" fill="none" stroke="{colors[name]}" stroke-width="2"/>')
            x, z, heading = run["way"][-1]
            lines.append(f'<g transform="translate({300 + 1000 * x:.1f} {44 - 250 * z:.1f}) '
                         f'rotate({10 * math.degrees(heading):.1f})"><path d="M-9 14L0-8 9 14Z" '
                         f'fill="{colors[name]}"/></g>')
    for i, (name, text) in enumerate((("ideal", "direct light alone"), ("real", "multipath and lens scatter"))):
        lines.append(f'<text x="20" y="{530 + 20 * i}" fill="{colors[name]}">{text}</text>')
    lines.append('<text x="580" y="550" text-anchor="end" fill="#666">aside 4 times, turns 10 times as large</text>')
    with open(file, "w", encoding="utf-8") as out:
        out.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 600 570" font-family="sans-serif" '
                  'font-size="14"><rect width="600" height="570" fill="white"/>\n' + "\n".join(lines) + "\n</svg>\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--ports", default="50010,5020", help="PCIC and Modbus, of the ideal camera; default %(default)s")
    parser.add_argument("--real-ports", default="50011,5021", help="of the realistic one; default %(default)s")
    parser.add_argument("--json", action="store_true", help="print numbers for programs")
    parser.add_argument("--svg", help="file for a drawing of the ways")
    parser.add_argument("--starts", type=int, default=3, help="how many of the three starts; default %(default)s")
    given = parser.parse_args()
    starts = [(0.12, -1.9, -0.05), (-0.15, -1.8, 0.08), (0.0, -2.0, 0.0)][:given.starts]
    results = {}
    for name, ports in (("ideal", given.ports), ("real", given.real_ports)):
        pcic, modbus = (int(port) for port in ports.split(","))
        camera, world = Camera(given.host, pcic), World(given.host, modbus)
        results[name] = []
        for start in starts:
            way, waits, there = dock(camera, world, *start)
            x, z, heading = way[-1]
            results[name].append({"docked": there, "steps": len(waits), "beside_mm": 1000 * x,
                                  "too_far_mm": 1000 * (-z - STOP_M), "turned_deg": math.degrees(heading),
                                  "pose_to_frame_ms": 1000 * statistics.median(waits), "way": way})
    if given.svg:
        draw(results, given.svg)
    if given.json:
        json.dump(results, sys.stdout)
        return
    print(f"{'camera':8}{'start':>24}{'steps':>7}{'beside':>10}{'too far':>10}{'turned':>9}{'pose to frame':>16}")
    for name, runs in results.items():
        for start, run in zip(starts, runs):
            where = f"{start[0]:+.2f} m {start[1]:+.2f} m {math.degrees(start[2]):+.0f}°"
            end = "" if run["docked"] else "   gave up"
            print(f"{name:8}{where:>24}{run['steps']:7}{run['beside_mm']:7.1f} mm{run['too_far_mm']:7.1f} mm"
                  f"{run['turned_deg']:8.2f}°{run['pose_to_frame_ms']:13.0f} ms{end}")


if __name__ == "__main__":
    main()
