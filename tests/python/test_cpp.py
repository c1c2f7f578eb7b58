"""The C++ tests and the C++ example, built and run."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nacre

TESTS = sorted((Path(__file__).parents[1] / "cpp").rglob("test_*.cpp"))
assert len(TESTS) > 20, "the C++ tests are somewhere else"


@pytest.mark.slow
@pytest.mark.parametrize("name", [path.stem for path in TESTS])
def test_cpp(name: str, cpp_tests: Path, run: Callable[..., str]) -> None:
    assert "SUCCESS!" in run(cpp_tests / name)


@pytest.mark.slow
def test_both_kinds_of_threads_give_the_same_bits(cpp_tests: Path, run: Callable[..., str]) -> None:
    with_openmp = cpp_tests / "test_parallel_openmp"
    if not with_openmp.exists():
        pytest.skip("the compiler has no OpenMP")
    for kind in ("threads", "openmp"):
        assert "SUCCESS!" in run(cpp_tests / f"test_parallel_{kind}")
    fingerprints = run(cpp_tests / "fingerprints_threads", OMP_NUM_THREADS="1")
    assert fingerprints.count("\n") > 10
    for kind in ("threads", "openmp"):
        assert run(cpp_tests / f"fingerprints_{kind}", OMP_NUM_THREADS="3") == fingerprints


@pytest.mark.slow
def test_reconstruct_example(cpp_examples: Path, run: Callable[..., str], tmp_path: Path) -> None:
    camera = nacre.Camera(width=160, height=120, fx=150, fy=150, cx=79.5, cy=59.5)
    thing = nacre.built_in_object()
    poses = nacre.turntable_poses(thing, 4, np.radians(10), camera=camera)
    for index, pose in enumerate(poses):
        depth = nacre.simulate_depth(thing.vertices, thing.triangles, camera, pose, noise=0.0003, seed=index)
        stored = np.nan_to_num(10000 * depth, nan=0).round().astype("<u2")
        stored.tofile(tmp_path / f"{index:03d}.raw")
    model = tmp_path / "model.ply"
    intrinsics = (str(value) for value in (160, 120, 150, 150, 79.5, 59.5, 10000))
    output = run(cpp_examples / "reconstruct", tmp_path, model, *intrinsics)

    assert output.count("TRACKED") == 4
    points = np.loadtxt(model.read_text().split("end_header\n")[1].splitlines())
    assert len(points) == int(output.split(" points in ")[0].splitlines()[-1]) > 500
    assert np.allclose(np.linalg.norm(points[:, 3:], axis=1), 1, atol=1e-4)
    in_world = points[:, :3] @ poses[0][:3, :3].T + poses[0][:3, 3]
    assert np.sqrt(np.mean(thing.distance(in_world) ** 2)) < 0.001


@pytest.mark.slow
def test_reconstruct_example_names_what_is_wrong(cpp_examples: Path, tmp_path: Path) -> None:
    (tmp_path / "000.raw").write_bytes(b"short")
    program = cpp_examples / "reconstruct"
    words = [program, tmp_path, tmp_path / "model.ply", "160", "120", "150", "150", "79.5", "59.5", "1000"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "000.raw must have 38400 bytes, has 5" in done.stderr
    assert not (tmp_path / "model.ply").exists()
    assert subprocess.run(words[:3], capture_output=True, check=False).returncode == 2
