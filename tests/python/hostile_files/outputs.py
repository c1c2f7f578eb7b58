"""Hostile folders that ``nacre reconstruct`` is said to have written."""

import json

from hostile_files.cameras import PINHOLE
from hostile_files.case import Case
from hostile_files.ply import TEXT, text, vertices

_POSE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
FRAME = {"index": 0, "status": "TRACKED", "world_from_camera": _POSE, "truth": None}
MODEL = text(
    "0 0 1 0 0 1\n1 0 1 0 0 1\n",
    vertices(2) + "".join(f"\nproperty float {name}" for name in ("nx", "ny", "nz")),
)


def report(**changes: object) -> bytes:
    """Return report.json with some things changed."""
    return json.dumps(
        {"title": "a", "recording": {"camera": PINHOLE}, "spacing": 0.1, "frames": [FRAME], **changes}
    ).encode()


def frames(*changes: dict[str, object]) -> bytes:
    """Return report.json whose frames say something else."""
    return report(frames=[{**FRAME, **change} for change in changes])


REPORTS = {
    "empty": (b"", r"report\.json, line 1: not a JSON file"),
    "nul bytes": (bytes(100), r"report\.json, line 1: not a JSON file"),
    "utf-16": (report().decode().encode("utf-16"), r"report\.json, byte 0: not text"),
    "cut in the middle": (report()[:100], r"report\.json, line 1: not a JSON file"),
    "a list": (b"[]", "not a report of nacre reconstruct"),
    "a number": (b"1", "not a report of nacre reconstruct"),
    "nested deep": (b'{"frames": ' + b"[" * 100_000, r"report\.json: .*nested"),
    "key twice": (b'{"frames": [], "frames": [1]}', r"report\.json: .*twice"),
    "without frames": (b"{}", "not a report of nacre reconstruct"),
    "frames a text": (report(frames="none"), "not a report of nacre reconstruct"),
    "frames of numbers": (report(frames=[1, 2]), r"report\.json: .*frames\[0\]"),
    "frame without index": (report(frames=[{"status": "TRACKED"}]), r"frames\[0\]"),
    "frame index a text": (frames({"index": "0"}), r"frames\[0\].*index"),
    "frame index negative": (frames({"index": -1}), r"frames\[0\].*index"),
    "frame without status": (frames({"status": None}), r"frames\[0\].*status"),
    "frame status unknown": (frames({"status": "SEEN"}), r"frames\[0\].*status"),
    "pose of three rows": (frames({"world_from_camera": _POSE[:3]}), r"frames\[0\].*world_from_camera"),
    "pose of words": (frames({"world_from_camera": "eye"}), r"frames\[0\].*world_from_camera"),
    "pose of nan": (
        frames({"world_from_camera": [[float("nan")] * 4] * 4}),
        r"frames\[0\].*world_from_camera",
    ),
    "pose of zeros": (frames({"world_from_camera": [[0] * 4] * 4}), r"frames\[0\].*world_from_camera"),
    "pose of second frame ragged": (
        frames({}, {"world_from_camera": [[1], [2, 3]]}),
        r"frames\[1\].*world_from",
    ),
    "truth of zeros": (frames({"truth": [[0] * 4] * 4}), r"frames\[0\].*truth"),
    "camera a list": (report(recording={"camera": [1]}), r"report\.json: a camera file must hold"),
    "camera of width 0": (report(recording={"camera": {**PINHOLE, "width": 0}}), r"report\.json: .*width"),
    "title an object": (report(title={"path": "a"}), r"report\.json: .*title must be a text"),
    "recording a text": (report(recording="here"), r"report\.json: .*recording"),
    "recording path a number": (report(recording={"path": 5}), r"report\.json: .*recording"),
    "recording path with nul": (report(recording={"path": "a\0b"}), r"report\.json: .*recording"),
    "spacing a text": (report(spacing="wide"), r"report\.json: .*spacing"),
    "spacing infinite": (report(spacing=float("inf")), r"report\.json: .*spacing"),
    "milliseconds a number": (frames({"milliseconds": 5}), r"frames\[0\].*milliseconds"),
    "overlap a text": (frames({"overlap": "much"}), r"frames\[0\].*overlap"),
}
MODELS = {
    "model cut": ({"model.ply": MODEL[:-8]}, r"model\.ply"),
    "model without normals": ({"model.ply": text(TEXT)}, r"model\.ply: .*normals"),
}
OUTPUTS = [
    *(
        Case(f"output/{n.replace(' ', '_')}", "output", {"report.json": data, "model.ply": MODEL}, said)
        for n, (data, said) in REPORTS.items()
    ),
    *(
        Case(f"output/{n.replace(' ', '_')}", "output", {"report.json": report(), **files}, said)
        for n, (files, said) in MODELS.items()
    ),
]
