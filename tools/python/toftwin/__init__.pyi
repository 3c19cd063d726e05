# SPDX-License-Identifier: Apache-2.0
# Types of the package toftwin, and the words on what is made in C++, which help() shows (docs_header.py).
import os
from pathlib import Path
from typing import Any, Iterator, Literal, Mapping, Optional, Sequence, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

PathLike = Union[str, "os.PathLike[str]"]
PlaneName = Literal["range", "depth", "amplitude", "ambient", "flags", "samples", "phasors", "truth_range", "truth_normal",
                    "exposure", "color", "light_sigma"]
Policy = Literal["latest", "queue", "lossless", "lockstep"]

class Error(RuntimeError):
    """Something that a correct program may meet: what, where, and what to do about it."""
    code: str

class CameraInfo:
    """Where a camera's pixels look: a pinhole with the distortion of OpenCV (k1, k2, p1, p2, k3). Pixel (0, 0) is the centre of
    the top left pixel."""
    def __init__(self, width: int, height: int, fx: float, fy: float, cx: float, cy: float,
                 distortion: Sequence[float] = ...) -> None:
        """A camera of that many pixels; focal lengths and principal point in pixels."""
    @property
    def width(self) -> int:
        """Pixels in a row."""
    @property
    def height(self) -> int:
        """Rows."""
    @property
    def fx(self) -> float:
        """Focal length along the rows, in pixels."""
    @property
    def fy(self) -> float:
        """Focal length along the columns, in pixels."""
    @property
    def cx(self) -> float:
        """Principal point along the rows, in pixels."""
    @property
    def cy(self) -> float:
        """Principal point along the columns, in pixels."""
    @property
    def distortion(self) -> list[float]:
        """k1, k2, p1, p2, k3."""
    @property
    def calibration_id(self) -> str:
        """Content hash of the calibration, or empty."""
    def rays(self) -> NDArray[np.float32]:
        """Unit vectors in the camera's frame along which the pixels look; shape (height, width, 3)."""

class Frame:
    """One frame of one source. `frame["range"]` is a plane as a NumPy array: shape (height, width), or (channels, height, width)
    of planes with several channels. Arrays are not copied and cannot be written into: where daemon and program share memory,
    they lie in it, for as long as the array is kept.

    range, depth, truth_range, light_sigma: float32, metres, NaN where invalid. amplitude, ambient: float32, the camera's unit
    (electrons if simulated). flags: uint8, bits. color: uint8, (3, height, width), red, green, blue. truth_normal: float32,
    (3, height, width), unit vectors."""
    def __init__(self, source: str, planes: Mapping[PlaneName, ArrayLike], camera: CameraInfo, *, sequence: int = 0,
                 received_ns: int = 0, world_from_camera: Optional[ArrayLike] = None) -> None:
        """A frame of arrays of one's own, which are copied: float32, uint8 or uint16, others become float32. They have the
        camera's height and width. ValueError if they do not."""
    def __getitem__(self, plane: PlaneName) -> NDArray[Any]: ...
    def __contains__(self, plane: str) -> bool: ...
    def __len__(self) -> int: ...
    @property
    def source(self) -> str:
        """Name of the source."""
    @property
    def sequence(self) -> int:
        """Counts up by one per source, without gaps."""
    @property
    def dropped_before(self) -> int:
        """Frames of this stream that were dropped since the last one."""
    @property
    def dropped_by_device(self) -> int:
        """Frames that were lost between camera and daemon since the last one."""
    @property
    def camera(self) -> CameraInfo:
        """Of the planes as they are, with region and decimation."""
    @property
    def received_ns(self) -> int:
        """When the daemon had the whole frame: nanoseconds since 1970."""
    @property
    def world_from_camera(self) -> Optional[NDArray[np.float64]]:
        """Pose of the camera, shape (4, 4), metres; None where it is not known."""
    @property
    def exposures(self) -> list[dict[str, float]]:
        """Raw exposures in the order taken: start_ns on the camera's clock, duration_s, modulation_hz."""
    @property
    def temperatures_c(self) -> dict[str, float]:
        """Temperatures in degrees Celsius by place, such as "sensor"."""
    @property
    def provenance(self) -> dict[str, Any]:
        """Where the frame comes from: kind, model_id, scene_id, calibration_id, seed, effects."""
    @property
    def planes(self) -> list[str]:
        """Names of the planes."""
    def keys(self) -> list[str]:
        """Names of the planes, so that dict(frame) works."""
    def points(self, *, world: bool = False) -> NDArray[np.float32]:
        """Points in metres, shape (height, width, 3), NaN where invalid: in the camera's frame, or with `world` in the world's.
        Made of range, or of depth without it. Error not_found if there is neither, or no pose."""

class Stream:
    """Frames of a source, to iterate over: it ends where the source ends. Close it, or use it in a `with`."""
    @property
    def source(self) -> str:
        """Name of the source."""
    def next(self, timeout: Optional[float] = None) -> Frame:
        """The next frame. Waits `timeout` seconds for it, those of stream() if None. Errors: timeout (ask again), end_of_stream,
        overrun, disconnected. Of a lockstep stream this is what lets the daemon make the frame: a pose that was set before is
        that of the frame."""
    def close(self) -> None:
        """Ends the stream; frames that were taken stay."""
    def __iter__(self) -> Iterator[Frame]: ...
    def __next__(self) -> Frame: ...
    def __enter__(self) -> "Stream": ...
    def __exit__(self, *args: object) -> None: ...

class Client:
    """A connection to a daemon; connect() makes it. All calls may be made from any thread."""
    def sources(self) -> list[dict[str, Any]]:
        """The daemon's sources: name, model, serial, kind, streaming, problem (why it is not there now, or "")."""
    def describe(self, source: str) -> dict[str, Any]:
        """All that the daemon says of a source: sources()' keys, driver, camera, planes, frame_interval_s, can_set_pose, can_trigger,
        can_lockstep, world_from_camera and parameters. These have a value, least, most, text and choices by name."""
    def stream(self, source: str, *, planes: Sequence[PlaneName] = ..., region: Optional[tuple[int, int, int, int]] = None,
               decimation: int = 1, max_rate_hz: float = 0.0, policy: Policy = "latest", queue: int = 4,
               timeout: float = 10.0) -> Stream:
        """Frames of a source from now on. `planes`: which; all if empty. `region`: x, y, width, height in pixels. `decimation`: every so manyth
        pixel. `max_rate_hz`: at most so many frames a second; 0 for all. `policy`: "latest" keeps the newest frame, "queue" the
        newest `queue` frames, "lossless" all, and "lockstep" makes a frame when next() asks. `timeout`: seconds that iterating waits for a frame."""
    def set_pose(self, source: str, world_from_camera: ArrayLike) -> None:
        """Puts a simulated camera there: a matrix of shape (4, 4), metres. ValueError if it is not of a rotation and a translation."""
    def set_parameter(self, source: str, name: str, value: Union[float, str]) -> None:
        """Sets a parameter of a camera: a number in the unit that the name ends in, or a text."""
    def trigger(self, source: str) -> None:
        """Has a camera that waits for a trigger take a frame."""
    def start_recording(self, source: str, file: str) -> str:
        """The daemon records into its recording folder; gives the path there."""
    def stop_recording(self, source: str) -> str:
        """Ends the recording; gives its path."""
    def health(self) -> dict[str, Any]:
        """How the daemon is: software, uptime_s, sessions and, of each of the sources, frames, losses, subscribers and errors."""
    def close(self) -> None:
        """Ends the connection once its streams are closed, too."""
    def __enter__(self) -> "Client": ...
    def __exit__(self, *args: object) -> None: ...

class Recording:
    """Frames of a file, to iterate over from its beginning; open() makes it. A damaged part is one Error malformed, and iterating on
    gives what follows."""
    @property
    def path(self) -> Path:
        """The file."""
    @property
    def sources(self) -> dict[str, int]:
        """Number of frames by source."""
    @property
    def first_ns(self) -> int:
        """When the first frame was received: nanoseconds since 1970."""
    @property
    def last_ns(self) -> int:
        """When the last frame was received: nanoseconds since 1970."""
    @property
    def damage(self) -> str:
        """What is wrong with the file and how much is lost, or ""."""
    def seek(self, received_ns: int) -> None:
        """Goes to the first frame at or after that time; next() gives it, iterating anew begins at the file's beginning."""
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Frame]: ...
    def __next__(self) -> Frame: ...

class Writer:
    """Writes frames into a file (MCAP). Close it, or use it in a `with`: that adds the index."""
    def __init__(self, path: PathLike, *, overwrite: bool = False) -> None:
        """Makes the file. Error invalid_argument if it is there and may not be overwritten."""
    def write(self, frame: Frame) -> None:
        """Appends a frame. Error storage_full where the disk is at its end."""
    @property
    def frames(self) -> int:
        """Frames that are in the file, or will be once it is closed."""
    def close(self) -> None:
        """Adds the index and brings all to the disk."""
    def __enter__(self) -> "Writer": ...
    def __exit__(self, *args: object) -> None: ...

class Renderer:
    """Frames of the simulator, without a daemon, to iterate over: one for each pose, or as many as asked for."""
    def __init__(self, camera: str, scene: str = "", poses: Optional[ArrayLike] = None, *, times_s: Sequence[float] = ...,
                 frames: int = 0, frame_interval_s: float = 0.0, planes: Sequence[PlaneName] = ..., samples: int = 4,
                 max_surfaces: int = 4, pixel_extent: float = 1.0, seed: int = 1, ambient_klx: float = 0.0,
                 room_temperature_c: float = 23.0, since_power_on_s: float = 10800.0) -> None:
        """`camera`: a preset or a file; `scene`: a file, or "" for a box before a wall; `poses`: world_from_camera, shape (4, 4) or (n, 4, 4).
        With `times_s`, seconds, one for each pose, the camera moves between them within frames, too; otherwise it stands at each
        pose for a frame. `frames`: how many; 0 for one, one a pose, or from the first time to the last. `frame_interval_s`: 0 for the camera's own.
        `planes`: which; empty for the five of a simulated source. `samples`: light paths a pixel. `max_surfaces`: that a path may
        meet. `pixel_extent`: side of a pixel's footprint in pixels. `since_power_on_s`: seconds that the camera has been on."""
    @property
    def camera(self) -> CameraInfo:
        """Where the camera's pixels look."""
    @property
    def model(self) -> str:
        """Name of the camera's model."""
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Frame]: ...
    def __next__(self) -> Frame: ...

class Discovered(TypedDict):
    headline: str
    sentences: list[str]
    cautions: list[str]
    model: str
    report: dict[str, Any]

class Corrected(TypedDict):
    corrected: NDArray[np.float64]
    unit: str
    csv: str
    report: dict[str, Any]

Table = Union[PathLike, Mapping[str, Sequence[Any]]]

def connect(address: str = "", *, token: str = "", authorities: str = "", certificate: str = "", key: str = "",
            timeout: float = 5.0) -> Client:
    """A connection to a daemon. `address`: "unix:/path", "tcp:host:port" or "tls:host:port"; "" for this machine's daemon. `token` says
    who this is, where the daemon has roles. `authorities`, `certificate`, `key`: PEM files, for "tls:". `timeout`: seconds that each
    question waits for its answer. Error disconnected if there is no daemon."""
def open(path: PathLike, *, source: str = "") -> Recording:
    """A recording (MCAP); with `source`, only its frames. Errors: not_found, malformed, incompatible."""
def cameras() -> list[str]:
    """Names of the presets that render() and Renderer know."""
def pose(position_m: ArrayLike = ..., rotation_wxyz: ArrayLike = ...) -> NDArray[np.float64]: ...
def look_at(position_m: ArrayLike, target_m: ArrayLike, up: ArrayLike = ...) -> NDArray[np.float64]: ...
def render(camera: str, scene: PathLike = "", poses: Optional[ArrayLike] = None, **options: Any) -> dict[str, NDArray[Any]]: ...
def discover(data: Table, *, map: Optional[PathLike] = None, seed: Optional[int] = None,
             draws: Optional[int] = None) -> Discovered: ...
def correct(data: Table, model: PathLike, *, map: Optional[PathLike] = None) -> Corrected: ...
