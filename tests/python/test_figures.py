"""The script that draws the pictures of the documentation runs, and draws something."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "docs" / "figures" / "make.py"
SOURCE = Path(nacre.__file__).resolve().parents[1]


def draw(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the script with the nacre under test."""
    return subprocess.run(
        [sys.executable, SCRIPT, "--small", *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_every_picture_is_drawn(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    done = draw("--out", tmp_path)
    assert done.returncode == 0, done.stderr
    drawn = {path.name for path in tmp_path.iterdir()}
    shown = {path.name.removeprefix("bunny-") for path in (ROOT / "docs" / "images").glob("*.webp")}
    of_recordings = ("model-teddy", "record", "removed-", "report", "viewer")
    of_benchmarks = ("model-bunny12", "model-spot12")
    assert drawn == {name for name in shown if not name.startswith(of_recordings + of_benchmarks)}
    for name in drawn:
        with image.open(tmp_path / name) as picture:
            pixels = np.asarray(picture.convert("L"), dtype=float)
        assert pixels.std() > 5, f"{name} is empty"


def test_a_name_that_does_not_exist_lists_those_that_do(tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    done = draw("nothing", "--out", tmp_path)
    assert done.returncode == 2
    assert "registration" in done.stderr
