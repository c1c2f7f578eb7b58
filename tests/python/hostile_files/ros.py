"""ROS recordings, where rosbags is installed to write them; and ones that define messages differently."""

import importlib.util
import tempfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hostile_files.case import Case
from hostile_files.depth_images import png

if TYPE_CHECKING:
    from ros_recorder import Recorder

WIDTH, HEIGHT = 8, 6
CHANGED = {  # lines of the definitions
    "no height": (b"uint32 height", b"uint32 haight", "height is None"),
    "no width": (b"uint32 width", b"uint32 wadth", "width is None"),
    "no encoding": (b"string encoding", b"string ancoding", "encoding is None"),
    "no byte order": (b"uint8 is_bigendian", b"uint8 is_pigendian", "is_bigendian is None"),
    "no data": (b"uint8[] data", b"uint8[] dota", "data is None"),
    "signed data": (b"uint8[] data", b"int8[]  data", "data is "),
    "no matrix": (b"float64[9] k", b"float64[9] q", "k is None"),
    "short numbers": (b"float64[9] k", b"uint64[9]  k", "k is "),
}


def recording(name: str) -> bytes:
    """Return a .bag, .mcap or .db3 of that name."""
    from ros_recorder import Recorder
    from rosbags.rosbag2 import StoragePlugin

    suffix = Path(name).suffix
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("a.bag" if suffix == ".bag" else "a")
        storage = StoragePlugin.MCAP if suffix == ".mcap" else StoragePlugin.SQLITE3
        recorder = Recorder(path, 1 if suffix == ".bag" else 2, storage)
        recorder.info("/camera/depth/camera_info", 10.0, WIDTH, HEIGHT)
        (_compressed if name.startswith("compressed") else _raw)(recorder)
        recorder.close()
        return (path if path.is_file() else next(path.glob(f"*{suffix}"))).read_bytes()


def _raw(recorder: "Recorder") -> None:
    for time in (1.0, 2.0):
        depth = np.arange(500, 500 + WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH)
        recorder.image("/camera/depth/image_raw", time, depth, "16UC1")
        recorder.image("/camera/color/image_raw", time, np.zeros((HEIGHT, WIDTH, 3), np.uint8), "rgb8")
        sure = np.ones((HEIGHT, WIDTH), np.uint8)
        recorder.image("/camera/confidence/image_raw", time, sure, "8UC1")


def _compressed(recorder: "Recorder") -> None:
    """Write depth as PNG, colours of its camera, and colours of another."""
    depth = bytes(12) + png(WIDTH, HEIGHT, data=zlib.compress(bytes((1 + 2 * WIDTH) * HEIGHT)))
    color = png(WIDTH, HEIGHT, 8, 2, zlib.compress(bytes((1 + 3 * WIDTH) * HEIGHT)))
    recorder.info("/camera/color/camera_info", 10.0, WIDTH, HEIGHT)
    recorder.info("/camera/rgb_wide/camera_info", 5.0, WIDTH, HEIGHT)
    recorder.compressed("/camera/depth/image_raw/compressedDepth", 1.0, depth, "16UC1; compressedDepth png")
    recorder.compressed("/camera/color/image_raw/compressed", 1.0, color, "rgb8; png compressed")
    recorder.compressed("/camera/rgb_wide/image_raw/compressed", 1.0, color, "rgb8; png compressed")


NAMES = ("a.bag", "a.mcap", "a.db3", "compressed.bag")
WHOLE = {name: recording(name) for name in NAMES if importlib.util.find_spec("rosbags") is not None}
ROS = [
    Case(
        f"recording/mcap_{what.replace(' ', '_')}",
        "recording",
        {"a.mcap": WHOLE["a.mcap"].replace(old + b"\n", new + b"\n")},
        f"of ROS: its {said}",
        "a.mcap",
        needs="rosbags",
    )
    for what, (old, new, said) in CHANGED.items()
    if WHOLE
]
if WHOLE:
    index = b"op=\x04\x08\x00\x00\x00ver=\x01\x00\x00\x00\t\x00\x00\x00conn="
    ROS.append(
        Case(
            "recording/bag_whose_index_leads_to_another_topic",
            "recording",
            {"a.bag": WHOLE["a.bag"].replace(index + b"\0", index + b"\1")},
            "damaged in /camera/depth/image_raw: a message of /camera/depth/camera_info",
            "a.bag",
            needs="rosbags",
        )
    )
