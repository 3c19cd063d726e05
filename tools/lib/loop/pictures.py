# SPDX-License-Identifier: Apache-2.0
"""Small pictures for a page, as PNG in a data URI."""
import base64
import math
import struct
import zlib

NOTHING = (122, 128, 134)  # the colour of a pixel without a number, on light pages and dark ones
BLUE, WHITE, RED = (33, 102, 172), (247, 247, 247), (178, 24, 43)


def png(width, height, colours):
    """data: URI of a picture of (red, green, blue), row by row."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    rows = (b"\0" + bytes(byte for colour in colours[y * width:(y + 1) * width] for byte in colour) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"".join(rows), 9)) + chunk(b"IEND", b"")
    return "data:image/png;base64," + base64.b64encode(data).decode()


def between(low, high, share):
    """The colour that lies at this share of the way."""
    return tuple(round(a + (b - a) * share) for a, b in zip(low, high))


def signed(value, full):
    """Blue where it is negative, white at zero, red where positive, darkest from `full` on."""
    if math.isnan(value):
        return NOTHING
    return between(WHITE, RED if value > 0 else BLUE, min(1.0, abs(value) / full))


def errors(width, height, values, full):
    """Picture of errors, in one colour scale for all pictures with this `full`."""
    return png(width, height, [signed(value, full) for value in values])


def brightness(width, height, values):
    """Picture of an amplitude: the root of it, so that dark things can be seen, up to its brightest hundredth."""
    valid = sorted(value for value in values if not math.isnan(value))
    full = valid[int(0.99 * (len(valid) - 1))] if valid else 1.0
    grey = (0 if math.isnan(v) else round(255 * math.sqrt(min(1.0, max(0.0, v) / full))) for v in values)
    return png(width, height, [(g, g, g) for g in grey])
