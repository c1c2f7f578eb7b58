"""ROS recordings, where rosbags is installed to write them; and ones that define messages differently."""

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

from hostile_files.case import Case

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
        for i in range(2):
            depth = np.arange(500, 500 + WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH)
            recorder.image("/camera/depth/image_raw", 1.0 + i, depth, "16UC1")
            recorder.image("/camera/color/image_raw", 1.0 + i, np.zeros((HEIGHT, WIDTH, 3), np.uint8), "rgb8")
            sure = np.ones((HEIGHT, WIDTH), np.uint8)
            recorder.image("/camera/confidence/image_raw", 1.0 + i, sure, "8UC1")
        recorder.close()
        return (path if path.is_file() else next(path.glob(f"*{suffix}"))).read_bytes()


NAMES = ("a.bag", "a.mcap", "a.db3") if importlib.util.find_spec("rosbags") is not None else ()
WHOLE = {name: recording(name) for name in NAMES}
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
