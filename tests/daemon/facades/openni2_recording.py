# SPDX-License-Identifier: Apache-2.0
"""Types keys into a window, and judges a recording of the daemon's source "pattern":
    openni2_recording.py type KEYS
    openni2_recording.py judge FILE.oni libOpenNI2.so.0"""

import array
import ctypes
import math
import sys
import time

IR, DEPTH = 1, 3  # ONI_SENSOR_...
NUMBER_OF_FRAMES = 8  # ONI_STREAM_PROPERTY_...
PLAYBACK_SPEED, REPEAT = 100, 101  # ONI_DEVICE_PROPERTY_...
EVERY = 13  # pixels, of which one is looked at


class Frame(ctypes.Structure):  # OniFrame
    _fields_ = ([("size", ctypes.c_int), ("data", ctypes.c_void_p), ("sensor", ctypes.c_int), ("stamp", ctypes.c_uint64)]
                + [(name, ctypes.c_int) for name in ("index", "width", "height", "format", "x", "y", "fps", "cropped",
                                                     "left", "top", "stride")])


def type_keys(keys):
    x11, xtst = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XKeysymToKeycode.argtypes = [ctypes.c_void_p, ctypes.c_ulong]
    x11.XKeysymToKeycode.restype = ctypes.c_ubyte
    x11.XFlush.argtypes = [ctypes.c_void_p]
    xtst.XTestFakeKeyEvent.argtypes = [ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_ulong]
    xtst.XTestFakeMotionEvent.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_ulong]
    display = x11.XOpenDisplay(None)
    xtst.XTestFakeMotionEvent(display, -1, 200, 200, 0)  # keys go to the window that the pointer is in
    x11.XFlush(display)
    time.sleep(0.3)
    for key in keys:
        code = x11.XKeysymToKeycode(display, ord(key))
        for is_down in (1, 0):
            xtst.XTestFakeKeyEvent(display, code, is_down, 0)
        x11.XFlush(display)
        time.sleep(0.3)


def frames_of(library, file, sensor):
    """The frames of one stream, and how many the file says there are."""
    device, stream, frame = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.POINTER(Frame)()
    if library.oniDeviceOpen(file.encode(), ctypes.byref(device)) != 0:
        sys.exit("FAILED: the recording cannot be opened")
    as_fast_as_read, never = ctypes.c_float(-1.0), ctypes.c_int(0)
    library.oniDeviceSetProperty(device, PLAYBACK_SPEED, ctypes.byref(as_fast_as_read), 4)
    library.oniDeviceSetProperty(device, REPEAT, ctypes.byref(never), 4)
    if library.oniDeviceCreateStream(device, sensor, ctypes.byref(stream)) != 0:
        sys.exit(f"FAILED: the recording has no stream of sensor {sensor}")
    count, size, ready = ctypes.c_int(), ctypes.c_int(4), ctypes.c_int()
    library.oniStreamGetProperty(stream, NUMBER_OF_FRAMES, ctypes.byref(count), ctypes.byref(size))
    library.oniStreamStart(stream)
    frames = []
    while len(frames) < count.value:
        if library.oniWaitForAnyStream(ctypes.byref(stream), 1, ctypes.byref(ready), 3000) != 0:
            break
        if library.oniStreamReadFrame(stream, ctypes.byref(frame)) != 0:
            break
        one = frame.contents
        frames.append((one.width, one.height, one.stamp, array.array("H", ctypes.string_at(one.data, one.size))))
        library.oniFrameRelease(frame)
    library.oniStreamStop(stream)
    library.oniStreamDestroy(stream)
    library.oniDeviceClose(device)
    return frames, count.value


def judge_depth(width, height, codes):
    """drivers/pattern/pattern.h: range = 1 m + ((x + y + shift) mod 256) / 64 m; the lens has fx = fy = width and
    its centre in the image's. Returns how many of the pixels that were looked at are no such depth, and the shift."""
    z = [1.0 / math.sqrt(1.0 + ((i % width - (width - 1) / 2) / width) ** 2
                         + ((i // width - (height - 1) / 2) / width) ** 2) for i in range(0, width * height, EVERY)]
    first = next(i for i in range(0, width * height, EVERY) if codes[i])
    shift = round((codes[first] / 1000 / z[first // EVERY] - 1) * 64) - first % width - first // width
    wrong = 0
    for i in range(0, width * height, EVERY):
        range_m = 1 + (i % width + i // width + shift) % 256 / 64
        wrong += codes[i] != 0 and abs(codes[i] - 1000 * range_m * z[i // EVERY]) > 0.501  # rounding, and floats
    return wrong, shift % 256


def judge(file, path):
    library = ctypes.CDLL(path)
    library.oniFrameRelease.argtypes = [ctypes.POINTER(Frame)]
    library.oniInitialize(2002)
    counts = []
    for sensor in (DEPTH, IR):
        frames, count = frames_of(library, file, sensor)
        shifts, stamps = set(), [stamp for _, _, stamp, _ in frames]
        for width, height, _, codes in frames:
            if sensor == IR:  # amplitude = 256 + ((x + 3 y) mod 128), 0 in the moving square of invalid pixels
                wrong = sum(codes[i] not in (0, 256 + (i % width + 3 * (i // width)) % 128)
                            for i in range(0, width * height, EVERY))
            else:
                wrong, shift = judge_depth(width, height, codes)
                shifts.add(shift)
            looked_at = range(0, width * height, EVERY)
            wrong += sum(codes[i] != 0 for i in looked_at) < 0.95 * len(looked_at)  # the square has 1.2 %
            if wrong:
                sys.exit(f"FAILED: a frame of sensor {sensor} has {wrong} pixels that are not the pattern's")
        if len(frames) != count or len(frames) < 10 or sorted(set(stamps)) != stamps:
            sys.exit(f"FAILED: sensor {sensor}: {len(frames)} of {count} frames, stamps {stamps}")
        if sensor == DEPTH and len(shifts) < len(frames) / 2:
            sys.exit(f"FAILED: {len(frames)} frames show the pattern in {len(shifts)} places only")
        counts.append(count)
    if abs(counts[0] - counts[1]) > 2:  # one is under way where recording begins, one where it ends
        sys.exit(f"FAILED: {counts[0]} frames of depth, but {counts[1]} infrared ones")
    print(f"it recorded {counts[0]} frames of depth and {counts[1]} infrared ones, all of them the pattern's")


if sys.argv[1] == "type":
    type_keys(sys.argv[2])
else:
    judge(sys.argv[2], sys.argv[3])
