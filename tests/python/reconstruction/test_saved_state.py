"""Records of frames, as the plain values that a saved run holds."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FileFormatError
from nacre.reconstruction import FrameRecord
from nacre.reconstruction.saved_state import record_from, record_state

TRUTH = np.eye(4)
GOOD = record_state(FrameRecord(3, 0.1, "LOST", "nothing was seen", None, TRUTH))


@pytest.mark.parametrize(
    "error", [None, ValueError("depth is too large"), FileFormatError(Path("3.png"), "cut short", offset=8)]
)
def test_a_record_comes_back_whole(error: Exception | None) -> None:
    record = FrameRecord(3, 0.1, "LOST", "nothing was seen", None, TRUTH, error)
    again = record_from(json.loads(json.dumps(record_state(record))), ())
    assert (again.index, again.timestamp, again.status, again.reason) == (3, 0.1, "LOST", "nothing was seen")
    assert again.truth is not None
    assert np.array_equal(again.truth, TRUTH)
    assert type(again.error) is type(error)
    assert str(again.error) == str(error)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"status": "FOUND"}, "no frame is 'FOUND'"),
        ({"status": "TRACKED"}, "no frame is 'TRACKED' whose report says LOST"),
        ({"status": []}, r"no frame is \[\]"),
        ({"status": None}, "no frame is None"),
        ({"reason": 5}, "reason must be a text, got 5"),
        ({"report": 0}, "there is no report 0"),
        ({"report": -1}, "report must be an integer of at least 0, got -1"),
        ({"report": math.inf}, "report must be an integer, got inf"),
        ({"index": -7}, "index must be an integer of at least 0, got -7"),
        ({"index": math.inf}, "index must be an integer, got inf"),
        ({"index": 10**400}, "index must be an integer below"),
        ({"timestamp": "noon"}, "timestamp must be a number, got 'noon'"),
        ({"timestamp": 10**400}, "timestamp must be a number that a float can hold"),
        ({"truth": [1.0, 2.0]}, "pose must be 16 finite numbers"),
        ({"truth": [10**400, *15 * [0]]}, "pose must be"),
        ({"truth": [math.nan, *15 * [0]]}, "pose must be 16 finite numbers"),
        ({"error": ["file", 5, "cut short", None, None]}, "path must be a text, got 5"),
        ({"error": ["file", "a", "cut short", [], None]}, r"\[\] is no place in a file"),
        ({"error": ["refused", {}]}, "error must be a text"),
    ],
)
def test_values_that_no_record_has_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        record_from({**GOOD, **change}, ())
