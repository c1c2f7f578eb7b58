"""Hostile checkpoints, and folders of runs that are said to be unfinished."""

import json
import pickle
import struct

import numpy as np

from hostile_files.case import Case, single
from hostile_files.saved_runs import SAVED_MODEL
from hostile_files.seals import sealed_line

FORMAT = int.from_bytes(SAVED_MODEL[8:12], "little")
_random = np.random.default_rng(7)


def checkpoint(body: bytes = b"", *, form: int = FORMAT, told: int | None = None, checksum: int = 0) -> bytes:
    """Return the header of a checkpoint, and a body."""
    length = 48 + len(body) if told is None else told
    return b"nacremdl" + struct.pack("<I20sQQ", form, b"0.1.0", length, checksum) + body


MODELS = {
    "empty": (b"", "byte 0"),
    "nul bytes": (bytes(500), "byte 0"),
    "garbage": (_random.bytes(2000), "byte 0"),
    "a pickle": (pickle.dumps(print), "byte 0"),
    "magic alone": (b"nacremdl", "byte 0"),
    "of another format": (checkpoint(form=77), "byte 8: .*format 77"),
    "of format 2 to the 32 - 1": (checkpoint(form=2**32 - 1), "byte 8"),
    "header alone": (checkpoint(), "byte 48"),
    "cut": (checkpoint(bytes(100), told=10_000), "byte 148: .*148 of its 10000 bytes"),
    "length 2 to the 64 - 1": (checkpoint(bytes(100), told=2**64 - 1), "byte 148"),
    "length too small": (checkpoint(bytes(100), told=48), "byte 48: .*148 bytes .*they are 48"),
    "checksum wrong": (checkpoint(bytes(100), checksum=1), "byte 40: .*checksum"),
    "body garbage": (checkpoint(_random.bytes(1000)), "byte 40: .*checksum"),
}
GOOD_RUN = {"format": 1, "nacre": "0.1.0", "folder": "/", "options": {"source": "here"}, "recording": None}


def run(asked: object, journal: bytes = b"") -> dict[str, bytes]:
    """Return OUT with an unfinished run."""
    text = asked if isinstance(asked, bytes) else json.dumps(asked).encode()
    return {"unfinished/run.json": text, "unfinished/journal.txt": journal, "unfinished/checkpoint": b""}


RUNS = {
    "run empty": (run(b""), r"run\.json, line 1: not a JSON file"),
    "run nul bytes": (run(bytes(50)), r"run\.json"),
    "run a list": (run([]), r"run\.json"),
    "run nested deep": (run(b"[" * 100_000), r"run\.json: .*nested"),
    "run of another format": (run({**GOOD_RUN, "format": 9}), r"run\.json: .*another version"),
    "run without options": (run({"format": 1}), r"run\.json: .*options"),
    "run whose options are a text": (run({"format": 1, "options": "all"}), r"run\.json: .*options"),
    "run without folder": (run(GOOD_RUN | {"folder": None}), r"run\.json: .*what was asked for"),
    "run whose recording is a list": (run(GOOD_RUN | {"recording": []}), r"run\.json: .*recording must be"),
    **{
        f"run whose {name} is {what}": (
            run(GOOD_RUN | {"options": {"source": "here", name: value}}),
            rf"run\.json: it does not say what was asked for \(.*{name}",
        )
        for name, what, value in (
            ("source", "a number", 5),
            ("source", "nul", "a\0b"),
            ("camera", "a list", []),
            ("depth_scale", "infinite", float("inf")),
            ("depth_scale", "a text", "1"),
            ("first", "negative", -1),
            ("last", "infinite", float("inf")),
            ("every", "zero", 0),
            ("every", "of 400 digits", 10**400),
            ("realtime", "a number", 2),
            ("report", "a text", "no"),
            ("min_tracked", "above one", 1.5),
            ("min_tracked", "a text", "half"),
            ("attribute", "a text", "heat=folder"),
            ("attribute", "a list of numbers", [1]),
            ("colour", "not known", True),
        )
    },
    "journal of a frame before the first": (
        run(GOOD_RUN, sealed_line(b'[-1,0,"LOST",null]')),
        r"journal\.txt, line 1",
    ),
    "journal forged": (run(GOOD_RUN, sealed_line(b"{")), r"journal\.txt, line 1"),
    "journal forged deep": (run(GOOD_RUN, sealed_line(b"[" * 100_000)), r"journal\.txt, line 1"),
    "journal of a number": (run(GOOD_RUN, sealed_line(b"7")), r"journal\.txt, line 1"),
    "journal of short entries": (run(GOOD_RUN, sealed_line(b"[1]")), r"journal\.txt, line 1"),
}
CHECKPOINTS = single("checkpoint", "checkpoint", "", MODELS) + [
    Case(f"checkpoint/{name.replace(' ', '_')}", "run", files, said) for name, (files, said) in RUNS.items()
]
