"""A saved model and a saved run, and runs whose check sum is right and that say what no run says."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import nacre
from hostile_files.case import Case
from hostile_files.seals import note_of, with_note
from nacre.reconstruction import FrameRecord, Reconstruction


def _saved(save: Callable[[Path], None]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        save(Path(folder) / "saved")
        return (Path(folder) / "saved").read_bytes()


def _model() -> nacre.Model:
    model = nacre.Model(nacre.Camera(4, 3, 5.0, 5.0, 1.5, 1.0), spacing=0.05)
    model.add_frame(np.ones((3, 4)), timestamp=1.0)
    return model


def _run() -> Reconstruction:
    """Return a run of three frames: one for the model, one of a damaged file, one that the model refused."""
    done = Reconstruction([], _model())
    seen = done.model.frames[0]
    damaged = nacre.FileFormatError("1.png", "it is damaged", line=2, offset=5)
    done.frames = [
        FrameRecord(0, 1.0, seen.status, seen.reason, seen, np.eye(4)),
        FrameRecord(1, 2.0, "LOST", str(damaged), None, None, damaged),
        FrameRecord(2, None, "LOST", "no", None, None, ValueError("no")),
    ]
    return done


SAVED_MODEL = _saved(_model().save)
SAVED_RUN = _saved(_run().save)


def forged(old: str, new: str) -> bytes:
    """Return the saved run with something else in the place of the first such words."""
    note = note_of(SAVED_RUN)
    assert old.encode() in note
    return with_note(SAVED_RUN, note.replace(old.encode(), new.encode(), 1))


FORGED = {
    "run of no JSON": ('"run": {', '"run": {{', "does not say the depth_scale"),
    "run nested deep": ('"retry": null', '"retry": ' + "[" * 50_000, "does not say the depth_scale"),
    "run a list": ('"run": {', '"run": [], "x": {', "no run that can go on"),
    "records a number": ('"records": [', '"records": 5, "x": [', "no run that can go on"),
    "record a number": ('"records": [', '"records": [5, ', "no run that can go on"),
    "depth scale nan": ('"depth_scale": 1.0', '"depth_scale": NaN', "depth_scale must be a positive"),
    "depth scale 1e-320": ('"depth_scale": 1.0', '"depth_scale": 1e-320', "depth_scale must be a positive"),
    "depth scale 1e308": ('"depth_scale": 1.0', '"depth_scale": 1e308', "depth_scale must be a positive"),
    "depth scale of 400 digits": ('"depth_scale": 1', '"depth_scale": 1' + "0" * 400, "depth_scale must be"),
    "depth scale a list": ('"depth_scale": 1.0', '"depth_scale": []', "depth_scale must be a number"),
    "index infinite": ('"index": 0', '"index": 1e999', "index must be an integer"),
    "index negative": ('"index": 0', '"index": -7', "index must be an integer of at least 0"),
    "index a text": ('"index": 0', '"index": "0"', "index must be an integer"),
    "report infinite": ('"report": 0', '"report": 1e999', "report must be an integer"),
    "report that is not there": ('"report": 0', '"report": 1', "there is no report 1"),
    "status unknown": ('"status": "LOST"', '"status": "SEEN"', "no frame is 'SEEN'"),
    "status null": ('"status": "LOST"', '"status": null', "no frame is None"),
    "status of another report": ('"status": "LOST"', '"status": "TRACKED"', "no frame is 'TRACKED'"),
    "truth of 400 digits": ('"truth": [1', '"truth": [1' + "0" * 400, "pose must be"),
    "truth infinite": ('"truth": [1.0', '"truth": [1e999', "pose must be 16 finite numbers"),
    "truth of 17": ('"truth": [1.0', '"truth": [1.0, 1.0', "pose must be 16 finite numbers"),
    "error without a file": ('"1.png", ', "7, ", "path must be a text"),
    "error of a place that is none": ("2, 5]", "[], {}]", "no place in a file"),
    "retry at infinity": (
        '"retry": null',
        '"retry": {"are_apart": true, "step": 1e999, "found_any": false}',
        "step must be an integer",
    ),
    "retry before the first": (
        '"retry": null',
        '"retry": {"are_apart": true, "step": -5, "found_any": false}',
        "step must be an integer of at least 0",
    ),
    "retry of no flag": (
        '"retry": null',
        '"retry": {"are_apart": true, "step": 0, "found_any": 3}',
        "found_any must be True",
    ),
}
SAVED_RUNS = [
    Case(f"run/{name.replace(' ', '_')}", "reconstruction", {"a": forged(old, new)}, said, "a")
    for name, (old, new, said) in FORGED.items()
]
