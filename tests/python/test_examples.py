"""The examples: each runs as it is, makes what it promises, and prints what the documentation shows."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nacre

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples" / "python"
PAGE = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
THING = nacre.built_in_object()


def run_example(name: str, folder: Path, *arguments: str | Path) -> str:
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def shown(name: str) -> list[str]:
    """Return the lines that the page shows of an example's output."""
    block = PAGE.split(f"/{name}\n", 1)[1].split("```text\n", 1)[1].split("```", 1)[0]
    return block.splitlines()


def is_shown(text: str, name: str) -> bool:
    """Say whether the page shows this output; figures may differ, and "..." stands for any lines."""

    def words(line: str) -> str:
        return " ".join(re.sub(r"[-+]?\d[\d.e+-]*", "#", line).split())

    lines, page = [words(line) for line in text.splitlines()], [words(line) for line in shown(name)]
    if "..." not in page:
        return lines == page
    gap = page.index("...")
    return lines[:gap] == page[:gap] and lines[-len(page) + gap + 1 :] == page[gap + 1 :]


def distance(points: np.ndarray, elevation: float = 0.0, first: float = 0.45) -> float:
    """Return the RMS distance of a model in its first camera's frame from the true surface."""
    camera = nacre.Camera(320, 240, 400, 400, 159.5, 119.5)
    pose = nacre.turntable_poses(THING, 1, camera=camera, distance=first, elevation=elevation)[0]
    return float(np.sqrt(np.mean(THING.distance(points @ pose[:3, :3].T + pose[:3, 3]) ** 2)))


def check_turntable(folder: Path, text: str) -> None:
    assert text.count("TRACKED") == 12
    # Neither table nor wall, and all sides of the object, down to where it stands.
    assert distance(nacre.read_points(folder / "object.ply").points, np.radians(30)) < 0.001


def check_hand_held(folder: Path, text: str) -> None:
    assert "20 of 20 frames tracked" in text
    assert len(nacre.read_trajectory(folder / "trajectory.txt").poses) == 20
    assert distance(nacre.read_points(folder / "scan.ply").points, first=0.4) < 0.001


def check_realsense(folder: Path, text: str) -> None:
    assert text.count("TRACKED") == 12
    assert distance(nacre.read_points(folder / "merged.ply").points, first=0.4) < 0.0015


def check_consolidate(folder: Path, text: str) -> None:
    before, after = (float(mm) for mm in re.findall(r"([\d.]+) mm from the surface", text))
    assert after < 0.9 * before
    assert len(nacre.read_points(folder / "thin.ply")) == 4000


def check_compare(folder: Path, text: str) -> None:
    cloud = nacre.read_points(folder / "differences.ply")
    assert cloud.colors is not None
    part = (cloud.colors[:, 0] > cloud.colors[:, 1]).mean()
    assert 0.05 < part < 0.15  # 15 % are missing; of these, what is near the rest does not show


def check_neighbours(folder: Path, text: str) -> None:
    assert "nacre: " in text
    assert float(text.split("distance: ")[1]) < 1e-12


CHECKS = {
    name.removeprefix("check_"): check for name, check in globals().items() if name.startswith("check_")
}


def test_every_example_is_tested_and_shown() -> None:
    names = {path.stem for path in EXAMPLES.glob("*.py")} - {"simulated"}
    assert names == {*CHECKS, "reconstruct"}
    for path in (*EXAMPLES.glob("*.py"), *(ROOT / "examples" / "cpp").glob("*.cpp")):
        assert path.name in PAGE, path.name
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 50 or path.stem == "reconstruct", path


@pytest.mark.parametrize("name", CHECKS)
def test_example(name: str, tmp_path: Path) -> None:
    if name == "neighbours":
        pytest.importorskip("scipy")
    text = run_example(name, tmp_path)
    CHECKS[name](tmp_path, text)
    assert is_shown(text, f"{name}.py"), text


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a recording of the example's turntable."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        from simulated import CAMERA, turntable
    folder = tmp_path_factory.mktemp("recording") / "mine"
    depth = (frame.depth for frame in itertools.islice(turntable(24), 3))
    nacre.write_recording(folder, CAMERA, depth, depth_scale=10000)
    return folder


@pytest.mark.parametrize("name", ["turntable", "hand_held", "realsense", "reconstruct"])
def test_example_on_a_recording_of_ones_own(name: str, recording: Path, tmp_path: Path) -> None:
    run_example(name, tmp_path, recording)
    (model,) = tmp_path.glob("*.ply")
    assert len(nacre.read_points(model)) > 500


@pytest.mark.parametrize("name", ["consolidate", "compare", "neighbours"])
def test_example_on_points_of_ones_own(name: str, tmp_path: Path) -> None:
    if name == "neighbours":
        pytest.importorskip("scipy")
    scan = tmp_path / "mine.ply"
    nacre.write_points(scan, THING.vertices[::5])
    text = run_example(name, tmp_path, *([scan, scan] if name == "compare" else [scan]))
    words = {"consolidate": "6706 points to 1341", "compare": "; 0% of", "neighbours": "of 6706 points"}
    assert words[name] in text


@pytest.mark.slow
def test_cpp_example(cpp_examples: Path, run: Callable[..., str]) -> None:
    text = run(cpp_examples / "turntable")
    assert text.count("TRACKED") == 12
    assert float(text.splitlines()[-1].split()[0]) < 0.2
    assert is_shown(text, "turntable.cpp"), text
