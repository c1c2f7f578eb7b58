"""Hostile recordings: folders whose lists lead astray, and files of ROS."""

import json
import zlib

import numpy as np

from hostile_files.cameras import PINHOLE, changed
from hostile_files.case import Case
from hostile_files.depth_images import pgm, png
from hostile_files.ply import GRID, TEXT, text, vertices
from hostile_files.trajectories import EYE, GOOD

DEPTH = pgm(65535, bytes((3, 232)) * 12)
CAMERA = json.dumps(PINHOLE).encode()
_random = np.random.default_rng(5)


def tum(depth: str | bytes, **more: str | bytes) -> dict[str, bytes]:
    """Return a TUM recording with this list of depth images; other files by their stems."""
    lists = {"depth": depth, **more}
    files = {f"{name}.txt": body.encode() if isinstance(body, str) else body for name, body in lists.items()}
    return {**files, "depth/1.pgm": DEPTH, "depth/2.pgm": DEPTH, "camera.json": CAMERA}


def plain(**more: str | bytes) -> dict[str, bytes]:
    """Return a plain recording; other files by their names, whose dot is written __."""
    files = {"camera.json": CAMERA, "depth/1.pgm": DEPTH, "depth/2.pgm": DEPTH}
    for name, body in more.items():
        files[name.replace("__", ".")] = body.encode() if isinstance(body, str) else body
    return files


NINE = [(float(x), float(y), 0.1 * x * y) for y in range(3) for x in range(3)]


def scan(points: list[tuple[float, float, float]], columns: int = 3, rows: int = 3) -> bytes:
    """Return a range scan whose grid is full."""
    told = f"obj_info num_cols {columns}\nobj_info num_rows {rows}\n{vertices(len(points))}\n"
    told += f"element range_grid {columns * rows}\nproperty list uchar int vertex_indices"
    lines = ["".join(f"{x} {y} {z}\n" for x, y, z in points), *(f"1 {k}\n" for k in range(len(points)))]
    return text("".join(lines), told)


def _escapes(name: str) -> str:
    return f"1 depth/1.pgm\n2 {name}\n"


TUM = {
    "tum list empty": (tum(""), r"depth\.txt.*the list is empty"),
    "tum list nul bytes": (tum(b"\0" * 50), r"depth\.txt.*line 1"),
    "tum list utf-16": (tum("1 depth/1.pgm\n".encode("utf-16")), r"depth\.txt.*not text"),
    "tum list word": (tum("one depth/1.pgm\n"), r"depth\.txt, line 1: expected 'timestamp file'"),
    "tum list nan": (tum("nan depth/1.pgm\n"), r"depth\.txt, line 1: expected 'timestamp file'"),
    "tum list 1e400": (tum("1e400 depth/1.pgm\n"), r"depth\.txt, line 1: expected 'timestamp file'"),
    "tum list without name": (tum("1\n"), r"depth\.txt, line 1: expected 'timestamp file'"),
    "tum list of missing files": (tum("1 depth/7.pgm\n"), r"depth\.txt: none of the 1 files"),
    "tum list goes back in time": (
        tum("2 depth/1.pgm\n1 depth/2.pgm\n"),
        r"depth\.txt, line 2: .*does not come",
    ),
    "tum list leads up": (tum(_escapes("../../../etc/1.pgm")), r"depth\.txt, line 2: refused: .*outside"),
    "tum list leads up inside": (tum(_escapes("depth/../../x/1.pgm")), r"depth\.txt, line 2: refused"),
    "tum list absolute": (tum(_escapes("/dev/zero.pgm")), r"depth\.txt, line 2: refused: .*outside"),
    "tum list of another drive": (tum(_escapes("C:\\1.pgm")), r"depth\.txt, line 2: refused"),
    "tum list leads up by backslashes": (tum(_escapes("..\\..\\1.pgm")), r"depth\.txt, line 2: refused"),
    "tum list nul in a name": (tum(_escapes("depth/2.pgm\0.png")), r"depth\.txt, line 2: refused"),
    "tum list name of 5000 letters": (
        tum(_escapes("x" * 5_000 + ".pgm")),
        r"depth\.txt, line 2: refused: a name of 5004 letters",
    ),
    "tum list name of 300 letters": (
        tum(_escapes("x" * 300 + ".pgm")),
        r"depth\.txt, line 2: refused: a name of 304 letters",
    ),
    "tum list of a folder": (tum(_escapes("depth")), "depth: .*must be one of|cannot be read"),
    "tum colours lead up": (tum("1 depth/1.pgm\n", rgb="1 ../1.png\n"), r"rgb\.txt, line 1: refused"),
    "tum colours absolute": (tum("1 depth/1.pgm\n", rgb="1 /1.png\n"), r"rgb\.txt, line 1: refused"),
    "tum truth damaged": (tum("1 depth/1.pgm\n", groundtruth=GOOD + "1 0\n"), r"groundtruth\.txt, line 2"),
    "tum image damaged": (
        tum("1 depth/1.pgm\n2 depth/3.pgm\n") | {"depth/3.pgm": DEPTH[:20]},
        r"3\.pgm, byte 20: truncated",
    ),
    "tum image of other size": (
        tum("1 depth/1.pgm\n2 depth/3.pgm\n") | {"depth/3.pgm": pgm(size="3 4")},
        r"3\.pgm: .*3 wide and 4 high",
    ),
}
PLAIN = {
    "plain camera damaged": (plain(camera__json="{"), r"camera\.json, line 1"),
    "plain camera of other size": (plain(camera__json=changed(width=5)), r"1\.pgm: the image is 4 wide"),
    "plain camera gigantic": (plain(camera__json=changed(width=2**31 - 1)), "wide|width"),
    "plain without images": ({"camera.json": CAMERA}, "needs depth images"),
    "plain times short": (plain(timestamps__txt="1\n"), r"timestamps\.txt: expected 2 finite times"),
    "plain times long": (plain(timestamps__txt="1\n2\n3\n"), r"timestamps\.txt: expected 2 finite times"),
    "plain times of words": (plain(timestamps__txt="1\ntwo\n"), r"timestamps\.txt, line 2: expected a time"),
    "plain times nan": (plain(timestamps__txt="1\nnan\n"), r"timestamps\.txt.*finite"),
    "plain times not monotonic": (
        plain(timestamps__txt="2\n1\n"),
        r"timestamps\.txt, line 2: .*does not come",
    ),
    "plain times utf-16": (plain(timestamps__txt="1\n2\n".encode("utf-16")), r"timestamps\.txt.*not text"),
    "plain images all damaged": (
        {"camera.json": CAMERA, "depth/1.pgm": b"P5", "depth/2.pgm": b""},
        "none of its 2 depth images can be read",
    ),
    "plain bomb of an image": (
        plain() | {"depth/3.png": png(60_000, 60_000)},
        r"3\.png: refused: .*60000 x 60000",
    ),
    "plain mask damaged": (plain() | {"mask/2.png": b"\x89PNG"}, r"2\.png: the image is damaged"),
    "plain attribute damaged": (
        plain() | {"attributes/ir/2.png": b"\x89PNG"},
        r"2\.png: the image is damaged",
    ),
}
LENS = [0.5, 0.49, 0.49, 0.49, 3.1, 2.3, 0.13, 3.5, 3.4, 0.66, 0, 0, -5e-5, 8e-5]
_DARK = zlib.compress(bytes(641 * 288), 9)


def calibration(parameters: object) -> bytes:
    """Return the calibration.json of an Azure Kinect with these parameters of its depth camera."""
    kind = "CALIBRATION_LensDistortionModelBrownConrady"
    lens = {"ModelParameters": parameters, "ModelType": kind}
    cameras = [{"Purpose": "CALIBRATION_CameraPurposeDepth", "Intrinsics": lens}]
    return json.dumps({"CalibrationInformation": {"Cameras": cameras}}).encode()


OTHER = {
    "icl list leads up": (
        {"associations.txt": b"1 ../d.pgm 1 rgb/1.png\n", "depth/1.pgm": DEPTH},
        r"associations\.txt, line 1: refused",
    ),
    "icl list absolute": (
        {"associations.txt": b"1 depth/1.pgm 1 /etc/passwd\n", "depth/1.pgm": DEPTH},
        r"associations\.txt, line 1: refused",
    ),
    "icl list short": (
        {"associations.txt": b"1 depth/1.pgm 1\n", "depth/1.pgm": DEPTH},
        r"associations\.txt, line 1: expected",
    ),
    "icl list of words": (
        {"associations.txt": b"1 rgb/1.png two depth/1.pgm\n", "depth/1.pgm": DEPTH, "rgb/1.png": b""},
        r"associations\.txt, line 1: expected",
    ),
    "icl truth twice": (
        {"a.gt.freiburg": GOOD.encode(), "b.gt.freiburg": GOOD.encode(), "depth/1.pgm": DEPTH},
        "more than one ground",
    ),
    "icl truth cut": ({"a.gt.freiburg": GOOD[:8].encode(), "depth/1.pgm": DEPTH}, r"a\.gt\.freiburg.*line 1"),
    "redwood log cut": (
        {"depth/1.pgm": DEPTH, "camera.json5": b"", "trajectory.log": ("0 0 1\n" + EYE[:20]).encode()},
        r"trajectory\.log",
    ),
    "redwood camera cut": ({"depth/1.pgm": DEPTH, "my_camera.json": b"{"}, r"my_camera\.json, line 1"),
    "7-scenes image damaged": ({"frame-000000.depth.png": b"\x89PNG"}, r"frame-000000\.depth\.png"),
    "stanford scan damaged": ({"a.ply": text(TEXT + "1 0\n1 9\n", GRID)}, r"a\.ply: .*outside 0 to 1"),
    "stanford scan of nothing": ({"a.ply": text(TEXT + "0\n0\n", GRID)}, r"a\.ply: .*fewer than 3 points"),
    "stanford scan of one place": (
        {"a.ply": scan([(0.0, 0.0, 0.0)] * 9)},
        "no camera sees these .*no two columns",
    ),
    "stanford scan of one column": (
        {"a.ply": scan([(0.0, float(k), 0.0) for k in range(9)], 1, 9)},
        "no camera sees these .*no two columns",
    ),
    "stanford scan with a far point": (
        {"a.ply": scan([*NINE[:8], (60000.0, 60000.0, 0.0)])},
        r"no camera sees these .*6e\+04 x 6e\+04 pixels, and have at most 9 points",
    ),
    "stanford scan of 1e-40 m": (
        {"a.ply": scan([(1e-40 * x, 1e-40 * y, 1.0) for x, y, _ in NINE])},
        "no camera sees these .*pixel_size",
    ),
    "stanford scan of infinite points": (
        {"a.ply": scan([(1e39, 1e39, 1e39)] * 9)},
        r"a\.ply: .*fewer than 3 points",
    ),
    "stanford scan of rows far apart": (
        {"a.ply": scan([(x, 20 * y, 0.0) for x, y, _ in NINE])},
        r"a\.ply: its rows are 20 m apart, columns of the first scan 1 m",
    ),
    "stanford place of words": (
        {"a.ply": scan(NINE), "a.conf": b"bmesh a.ply 0 0 zero 0 0 0 1\n"},
        r"a\.conf, line 1: expected 'bmesh",
    ),
    "stanford place 1e300": (
        {"a.ply": scan(NINE), "a.conf": b"bmesh a.ply 0 1e300 0 0 0 0 1\n"},
        r"a\.conf, line 1: expected 'bmesh",
    ),
    "tum truth 1e300": (
        tum("1 depth/1.pgm\n", groundtruth="1 1e300 0 0 0 0 0 1\n"),
        r"groundtruth\.txt, line 1",
    ),
    "stanford place without turn": (
        {"a.ply": scan(NINE), "a.conf": b"bmesh a.ply 0 0 0 0 0 0 0\n"},
        r"a\.conf, line 1: expected 'bmesh",
    ),
    "stanford header without end": (
        {"a.ply": b"ply\nelement range_grid 2\n" + b"x" * 9000},
        r"a\.ply, line 4: the file ends before end_header",
    ),
    "azure calibration damaged": (
        {"calibration.json": b"{", "depth/1.pgm": pgm()},
        r"depth images are|calibration",
    ),
    "azure calibration of nothing": (
        {"calibration.json": b"{}", "depth/1.pgm": b"P5\n512 512\n65535\n" + bytes(2 * 512 * 512)},
        r"calibration\.json: not the calibration",
    ),
    "azure calibration deep": (
        {"calibration.json": b"[" * 90_000, "depth/1.pgm": b"P5\n512 512\n65535\n" + bytes(2 * 512 * 512)},
        r"calibration\.json",
    ),
    **{
        f"azure parameters {what}": (
            {"calibration.json": calibration(parameters), "depth/1.png": png(320, 288, data=_DARK)},
            r"calibration\.json: .*" + said,
        )
        for what, parameters, said in (
            ("a number", 5, r"got an array \(\)"),
            ("of thirteen", LENS[:13], "got 13 of"),
            ("of tables", [[x] for x in LENS], r"got an array \(14, 1\)"),
            ("of words", ["wide", *LENS[1:]], "not the calibration"),
            ("infinite", [float("inf"), *LENS[1:]], "14 finite parameters"),
            ("of 1e308", [*LENS[:4], 1e308, *LENS[5:]], "14 finite parameters"),
            ("of no focal length", [0.5, 0.5, 0, 0.5, *LENS[4:]], "14 finite parameters"),
            ("of 400 digits", [10**400, *LENS[1:]], "not the calibration"),
        )
    },
    "an empty folder": ({"folder/.hidden": b""}, "no known recording|the folder is empty"),
}
ROS_FILES = {
    "bag empty": ("a.bag", b"", "not a whole ROS recording"),
    "bag garbage": ("a.bag", b"#ROSBAG V2.0\n" + _random.bytes(4000), "not a whole ROS recording"),
    "bag of lengths 2 to the 32 - 1": (
        "a.bag",
        b"#ROSBAG V2.0\n" + b"\xff" * 200,
        "not a whole ROS recording",
    ),
    "mcap empty": ("a.mcap", b"", "not a whole ROS recording"),
    "mcap garbage": ("a.mcap", b"\x89MCAP0\r\n" + _random.bytes(4000), "not a whole ROS recording"),
    "mcap of lengths 2 to the 63": (
        "a.mcap",
        b"\x89MCAP0\r\n" + b"\x01" + b"\xff" * 7 + b"\x7f" + bytes(100),
        "not a whole ROS recording",
    ),
    "db3 empty": ("a.db3", b"", "not a whole ROS recording"),
    "db3 garbage": ("a.db3", b"SQLite format 3\0" + _random.bytes(4000), "not a whole ROS recording"),
}
YAML = """rosbag2_bagfile_information:
  version: 5
  storage_identifier: sqlite3
  relative_file_paths: [{path}]
  duration: {{nanoseconds: 1}}
  starting_time: {{nanoseconds_since_epoch: 1}}
  message_count: 0
  topics_with_message_count: []
  compression_format: ''
  compression_mode: ''
"""
LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{','.join([f'*{chr(97 + i)}'] * 9)}]\n" for i in range(9)
)
ROS_FOLDERS = {
    "ros folder leads up": {"metadata.yaml": YAML.format(path="../../../etc/passwd").encode(), "a.db3": b""},
    "ros folder absolute": {"metadata.yaml": YAML.format(path="/etc/passwd").encode(), "a.db3": b""},
    "ros folder runs python": {
        "metadata.yaml": b"!!python/object/apply:os.system ['exit']\n",
        "a.db3": b"",
    },
    "ros folder of a billion laughs": {"metadata.yaml": LAUGHS.encode(), "a.db3": b""},
    "ros folder deep": {"metadata.yaml": b"[" * 20_000, "a.db3": b""},
    "ros folder empty": {"metadata.yaml": b"", "a.db3": b""},
}


def _name(name: str) -> str:
    return f"recording/{name.replace(' ', '_')}"


RECORDINGS = [
    *(Case(_name(n), "recording", files, said) for n, (files, said) in (TUM | PLAIN | OTHER).items()),
    *(
        Case(_name(n), "recording", {file: data}, said, file, needs="rosbags")
        for n, (file, data, said) in ROS_FILES.items()
    ),
    *(Case(_name(n), "recording", files, "ROS", needs="rosbags") for n, files in ROS_FOLDERS.items()),
    Case(
        _name("tum image is a pipe"),
        "recording",
        tum("1 depth/1.pgm\n2 depth/3.pgm\n"),
        "not a regular file",
        pipes=("depth/3.pgm",),
    ),
    Case(
        _name("tum image is a device"),
        "recording",
        tum("1 depth/1.pgm\n2 depth/3.pgm\n"),
        "not a regular file",
        links={"depth/3.pgm": "/dev/zero"},
    ),
    Case(
        _name("tum image links to itself"),
        "recording",
        tum("1 depth/1.pgm\n2 depth/3.pgm\n"),
        "cannot be read",
        links={"depth/3.pgm": "3.pgm"},
    ),
]
