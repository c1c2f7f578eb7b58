"""Records of frames, as the plain values that a saved run holds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FileFormatError
from nacre.reconstruction import FrameRecord
from nacre.run_state import record_from, record_state

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
        ({"reason": 5}, "no frame is 'LOST'"),
        ({"report": 0}, "there is no report 0"),
        ({"report": -1}, "there is no report -1"),
        ({"timestamp": "noon"}, "'noon' is no time"),
        ({"truth": [1.0, 2.0]}, "reshape"),
    ],
)
def test_values_that_no_record_has_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        record_from({**GOOD, **change}, ())
