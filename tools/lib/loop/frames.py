# SPDX-License-Identifier: Apache-2.0
"""Images of a run of `toftwin measure`, with nothing but Python's own library. An image is a list of numbers, row by
row, NaN where the camera gave none."""
import array
import ast
import json
import math
import pathlib
import subprocess
import tempfile

NAN = float("nan")


def read_npy(path):
    """(width, height, numbers) of a NumPy file of floats with two axes, as `toftwin replay` writes it."""
    data = pathlib.Path(path).read_bytes()
    length = int.from_bytes(data[8:10], "little")
    header = ast.literal_eval(data[10:10 + length].decode())
    if header["descr"] != "<f4" or len(header["shape"]) != 2:
        raise ValueError(f"{path}: {header} is not one image of floats")
    numbers = array.array("f", data[10 + length:])
    height, width = header["shape"]
    return width, height, numbers


def mean_image(toftwin, recording, plane):
    """(width, height, mean over the frames): NaN where fewer than half of the frames have a number."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([toftwin, "replay", str(recording), "-p", plane, "-o", f"{folder}/image.npy"],
                       check=True, stdout=subprocess.DEVNULL)
        images = [read_npy(path) for path in sorted(pathlib.Path(folder).glob("*.npy"))]
    width, height, _ = images[0]
    mean = []
    for values in zip(*(numbers for _, _, numbers in images)):
        valid = [value for value in values if not math.isnan(value)]
        mean.append(sum(valid) / len(valid) if 2 * len(valid) >= len(images) else NAN)
    return width, height, mean


def captures_of(run):
    """Lines of a run's index by the name of their pose, so that two runs of one plan can be put side by side."""
    with open(pathlib.Path(run) / "index.jsonl", encoding="utf-8") as file:
        return {line["name"]: line for line in map(json.loads, file)}


def away_from_edges(width, height, range_m, pixels=1, jump=0.03):
    """Whether each pixel has no jump of the range, and no pixel without one, within so many pixels of it. A pixel on
    an edge sees two surfaces at once, and the traced light is too noisy there to say anything of a camera."""
    def is_even(x, y):
        here = range_m[y * width + x]
        for v in range(max(0, y - pixels), min(height, y + pixels + 1)):
            for u in range(max(0, x - pixels), min(width, x + pixels + 1)):
                # Written so that NaN is a jump.
                if not abs(range_m[v * width + u] - here) <= jump * here * max(abs(u - x), abs(v - y), 1):
                    return False
        return True

    return [is_even(x, y) for y in range(height) for x in range(width)]


def difference_mm(a, b, judged):
    """b - a in millimetres where both are numbers and the pixel is judged, else NaN."""
    return [1000.0 * (y - x) if good else NAN for x, y, good in zip(a, b, judged)]


def rms(values):
    """Root of the mean square of all that are numbers; NaN if none is."""
    squares = [value * value for value in values if not math.isnan(value)]
    return math.sqrt(sum(squares) / len(squares)) if squares else NAN
