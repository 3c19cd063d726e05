# SPDX-License-Identifier: Apache-2.0
"""Time-of-flight cameras, real and simulated: their frames as NumPy arrays.

connect() gives the cameras of a daemon, open() those of a recording, render() those of the simulator. Planes have the shape
(height, width), or (channels, height, width); lengths are in metres, NaN where a pixel is invalid. Poses are 4 x 4 matrices
`world_from_camera`; the camera's x goes right, its y down, its z along the optical axis."""
import json as _json
import os as _os

import numpy as _np

from . import _toftwin
from ._toftwin import (CameraInfo, Client, Error, Frame, Recording, Renderer, Stream, Writer, __version__, cameras, connect,
                       open)

__all__ = ["CameraInfo", "Client", "Error", "Frame", "Recording", "Renderer", "Stream", "Writer", "cameras", "connect", "correct",
           "discover", "look_at", "open", "pose", "render"]


def pose(position_m=(0.0, 0.0, 0.0), rotation_wxyz=(1.0, 0.0, 0.0, 0.0)):
    """Matrix world_from_camera, shape (4, 4), of a place in metres and a rotation (quaternion w, x, y, z; any length)."""
    w, x, y, z = _np.asarray(rotation_wxyz, float) / _np.linalg.norm(rotation_wxyz)
    world_from_camera = _np.eye(4)
    world_from_camera[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                                 [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                                 [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    world_from_camera[:3, 3] = position_m
    return world_from_camera


def look_at(position_m, target_m, up=(0.0, -1.0, 0.0)):
    """Matrix world_from_camera, shape (4, 4), of a camera at `position_m` whose optical axis meets `target_m`, both in metres.

    `up` is the direction that is up in the image; the world's y goes down. ValueError where these leave the camera's roll open."""
    position = _np.asarray(position_m, float)
    z = _np.asarray(target_m, float) - position
    x = -_np.cross(up, z)  # the image's y goes down
    if not _np.linalg.norm(z) > 0 or not _np.linalg.norm(x) > 1e-9 * _np.linalg.norm(z):
        raise ValueError("look_at: the target must be somewhere else than the camera, and not straight above or below it")
    z, x = z / _np.linalg.norm(z), x / _np.linalg.norm(x)
    world_from_camera = _np.eye(4)
    world_from_camera[:3, :4] = _np.column_stack([x, _np.cross(z, x), z, position])
    return world_from_camera


def render(camera, scene="", poses=None, **options):
    """Frames of the simulator, without a daemon: a dictionary of arrays of shape (n, height, width), or (n, channels, height, width).

    `camera` is a preset (cameras() lists them) or a camera file, `scene` a scene file or "" for a box before a wall, `poses` one
    world_from_camera of shape (4, 4) or several of shape (n, 4, 4). All other options are those of Renderer. The same seed gives
    the same bytes."""
    frames = list(Renderer(camera, _os.fspath(scene), poses, **options))
    return {plane: _np.stack([frame[plane] for frame in frames]) for plane in frames[0].planes}


def _field(value):
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if any(one in text for one in ',"\n') else text


def _table(data):
    """What the module takes: a table's text and no file, or no text and a file."""
    if isinstance(data, (str, _os.PathLike)):
        return "", _os.fspath(data)
    columns = {name: list(data[name]) for name in data.keys()}
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise ValueError(f"a table's columns are all of one length, not of {sorted(lengths)}")
    lines = [",".join(map(_field, columns))] + [",".join(map(_field, row)) for row in zip(*columns.values())]
    return "\n".join(lines) + "\n", ""


def discover(data, *, map=None, seed=None, draws=None):
    """What the errors of measured values go with, as `toftwin discover` tells it.

    `data` is the path of a table, or its columns by header (a dictionary, a pandas.DataFrame). `map` is the path of a TOML file
    that says what the columns are, where headers do not. The dictionary has `headline`, `sentences` and `cautions` for people, `model` (TOML for
    correct(); empty if it would be no better than none) and `report`, the numbers of report.json."""
    csv, file = _table(data)
    found = _toftwin._discover(csv, file, _os.fspath(map or ""), seed, draws)
    found["report"] = _json.loads(found["report"])
    return found


def correct(data, model, *, map=None):
    """Takes a learned error off measured values, as `toftwin correct` does.

    `data` and `map` are as for discover(), `model` is its `model` or the path of such a file. The dictionary has `corrected`, shape (rows,), in
    `unit` and NaN where a row lacks a value, `csv`, the table with that column, and `report` with the RMS before and after."""
    csv, file = _table(data)
    is_text = isinstance(model, str) and "\n" in model
    done = _toftwin._correct(csv, file, _os.fspath(map or ""), model if is_text else "", "" if is_text else _os.fspath(model))
    done["report"] = _json.loads(done["report"])
    return done
