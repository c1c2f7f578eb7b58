"""Small recordings of every format, results, runs and checkpoints that are as they should be."""

import json
import zlib

import numpy as np

from hostile_files.cameras import OPEN3D
from hostile_files.case import Case
from hostile_files.checkpoints import GOOD_RUN, run
from hostile_files.depth_images import npy, png
from hostile_files.outputs import FRAME, MODEL, report
from hostile_files.phones import HEAD, PLANE, TOLD, r3d, stray
from hostile_files.recordings import DEPTH, LENS, NINE, calibration, plain, scan, tum
from hostile_files.ros import WHOLE
from hostile_files.saved_runs import SAVED_MODEL, SAVED_RUN
from hostile_files.seals import sealed_line
from hostile_files.trajectories import EYE, GOOD


def _image(width: int, height: int, channels: int = 0) -> bytes:
    """Return a PNG that is all alike: a depth of 1000 units, or a colour."""
    row = b"\0" + (bytes(range(channels)) if channels else b"\x03\xe8") * width
    data = zlib.compress(row * height, 9)
    return png(width, height, *((8, 2) if channels else (16, 0)), data=data)


_VGA, _VGA_COLOR = _image(640, 480), _image(640, 480, 3)
_COLOR = _image(4, 3, 3)
_LOG = "".join(f"{i} {i} {i + 1}\n{EYE}" for i in range(2)).encode()
_TRUTH = GOOD + "1" + GOOD[1:]
RECORDINGS: dict[str, dict[str, bytes]] = {
    "tum": tum("1 depth/1.pgm\n2 depth/2.pgm\n", groundtruth=_TRUTH, rgb="1 rgb/1.png\n")
    | {"rgb/1.png": _COLOR},
    "freiburg": {
        "depth.txt": b"# file: 'rgbd_dataset_freiburg3_teddy.bag'\n1.5 depth/1.png\n",
        "rgb.txt": b"1.51 rgb/1.png\n",
        "depth/1.png": _VGA,
        "rgb/1.png": _VGA_COLOR,
    },
    "redwood": {
        "depth/1.pgm": DEPTH,
        "depth/2.pgm": DEPTH,
        "image/1.png": _COLOR,
        "image/2.png": _COLOR,
        "intrinsic.json": json.dumps(OPEN3D).encode(),
        "trajectory.log": _LOG,
    },
    "7-scenes": {
        "frame-000000.depth.png": _VGA,
        "frame-000000.color.png": _VGA_COLOR,
        "frame-000000.pose.txt": EYE.encode(),
    },
    "icl-nuim": {
        "associations.txt": b"1 depth/1.png 1 rgb/1.png\n2 depth/1.png 2 rgb/1.png\n",
        "a.gt.freiburg": _TRUTH.encode(),
        "depth/1.png": _VGA,
        "rgb/1.png": _VGA_COLOR,
    },
    "icl-nuim_numbered": {
        "a.gt.freiburg": _TRUTH.encode(),
        "depth/0.png": _VGA,
        "depth/1.png": _VGA,
        "depth/1\N{SUPERSCRIPT TWO}1.png": _VGA,  # a digit that is no number
        "depth/\N{SUPERSCRIPT TWO}.png": _VGA,
    },
    "plain": plain(timestamps__txt="1\n2\n", groundtruth__txt=_TRUTH)
    | {"color/1.png": _COLOR, "mask/1.png": png(bits=8), "attributes/heat/1.npy": npy(np.ones((3, 4)))},
    "stanford": {
        "a.ply": scan(NINE),
        "b.ply": scan(NINE),
        "scans.conf": b"camera 0 0 0 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 0 0 1 0 0.6 0 0.8\n",
    },
    "azure": {"calibration.json": calibration(LENS), "depth/1.png": _image(320, 288)},
    "stray": stray(HEAD + "0,0,0,0,0,0,0,0,1\n") | {"confidence/000000.png": png(bits=8)},
}
# Those of one file, and those that a module reads.
PACKED = {
    "a.r3d": (r3d(), "liblzfse"),
    **{name: (data, "rosbags") for name, data in WHOLE.items()},
}
_metadata = {"metadata": json.dumps(TOLD).encode(), "rgbd/0.depth": PLANE}
_ENTRIES = (b'[0,1.0,"TRACKED",[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]]', b'[1,null,"LOST",null]')
FOLDERS = [
    *(Case(f"recording/{name}", "recording", files, "") for name, files in RECORDINGS.items()),
    *(
        Case(f"recording/{name}", "recording", {name: data}, "", name, needs=module)
        for name, (data, module) in PACKED.items()
    ),
    Case("recording/metadata", "recording", _metadata, "", needs="liblzfse"),
    Case(
        "output/valid",
        "output",
        {"report.json": report(frames=[FRAME, {**FRAME, "index": 1}]), "model.ply": MODEL},
        "",
    ),
    Case(
        "output/valid_of_a_recording_that_is_gone",
        "output",
        {"report.json": report(recording={"path": 300 * "x"}), "model.ply": MODEL},
        "",
    ),
    Case("checkpoint/valid_model", "checkpoint", {"a": SAVED_MODEL}, "", "a"),
    Case("checkpoint/valid_run", "reconstruction", {"a": SAVED_RUN}, "", "a"),
    Case("checkpoint/valid_folder", "run", run(GOOD_RUN, b"".join(map(sealed_line, _ENTRIES))), ""),
]
