"""Small simulated recordings, and what ``nacre reconstruct`` makes of each alone."""

from pathlib import Path
from typing import Any

import pytest
from killed_runs import command, results

import nacre

NAMES = ("bowl", "cup", "mug")
NUM_FRAMES = 8


@pytest.fixture(scope="session", name="scans")
def simulated_recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with three recordings of the built-in object, and one that cannot be read."""
    folder = tmp_path_factory.mktemp("batch") / "scans"
    mesh = nacre.built_in_object()
    camera = nacre.Camera(width=80, height=60, fx=65.5, fy=65.5, cx=39.5, cy=29.5)
    poses = nacre.turntable_poses(mesh, NUM_FRAMES, 0.1, camera=camera)
    for number, name in enumerate(NAMES):
        depths = [mesh.simulate_depth(camera, pose, noise=0.0005, seed=number) for pose in poses]
        nacre.write_recording(folder / name, camera, depths, depth_scale=20000, poses=poses)
    broken = folder / "broken"
    broken.mkdir()
    (broken / "depth.txt").write_text("no list\n")
    return folder


@pytest.fixture(scope="session", name="alone")
def reconstructed_alone(scans: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the bytes of each recording's results."""
    found = {}
    for name in NAMES:
        out = tmp_path_factory.mktemp("alone") / name
        assert command("reconstruct", scans / name, "-o", out, "--no-report")[0] == 0
        found[name] = results(out)
    return found
