"""Damaged files give an error or what is in them, which an independent reader tells: never something else."""

import math
import random
from pathlib import Path

import numpy as np
import pytest
from hostile_files import CASES, oracle
from hostile_files.damage import damaged, scratched
from hostile_files.valid import VALID

import nacre
from nacre.io.cameras import read_camera
from nacre.io.images import read_depth
from nacre.io.meshes import read_mesh_arrays
from nacre.io.ply import read_range_grid

NUM_FILES = 1000


def same(values, expected):
    return len(values) == len(expected) and all(
        a == b or (math.isnan(a) and math.isnan(b)) or (abs(b) > 3.4e38 and math.isinf(a))
        for a, b in zip(values, expected, strict=True)
    )


def check_points(path, data, read):
    cloud, columns = nacre.read_points(path), read(data)
    for axis, name in enumerate("xyz"):
        assert same(cloud.points[:, axis].tolist(), columns[name])
    for name, array in cloud.attributes.items():
        if array.ndim == 1 and array.dtype != object and name in columns:
            assert same(array.tolist(), columns[name])


def check_trajectory(path, data):
    found, (times, poses) = nacre.read_trajectory(path), oracle.trajectory(data)
    assert found.timestamps.tolist() == times
    np.testing.assert_allclose(found.poses, poses, atol=0.02)


def check_camera(path, data):
    found = read_camera(path).camera
    if found.model == "pinhole":
        assert [found.width, found.height, found.fx, found.fy, found.cx, found.cy] == oracle.camera(data)


CHECKS = {
    ".ply": lambda path, data: check_points(path, data, oracle.ply),
    ".pcd": lambda path, data: check_points(path, data, oracle.pcd),
    ".png": lambda path, data: np.testing.assert_array_equal(read_depth(path), oracle.png(data)),
    ".pgm": lambda path, data: np.testing.assert_array_equal(read_depth(path), oracle.pgm(data)),
    ".txt": check_trajectory,
    ".log": check_trajectory,
    ".json": check_camera,
}
READERS = {".ply": "points", ".pcd": "points", ".png": "depth", ".pgm": "depth", ".json": "camera"}


def seeds(suffix):
    """Return the valid files of a suffix, each many times, and the small hostile ones."""
    reader = READERS.get(suffix, "trajectory")
    found = []
    for cases, times in ((VALID, 40), (CASES, 1)):
        for case in cases.values():
            if case.reader == reader and Path(case.opens).suffix == suffix:
                data = case.files[case.opens]
                if len(data) < 5000 and b"binary_compressed" not in data:
                    found += times * [data]
    return found


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", CHECKS)
def test_what_is_read_is_what_is_there(tmp_path, suffix):
    chance = random.Random(suffix)
    path = tmp_path / f"a{suffix}"
    originals = seeds(suffix)
    num_read = 0
    for k in range(NUM_FILES):
        data = (damaged, scratched)[k % 2](originals, chance)
        path.write_bytes(data)
        try:
            CHECKS[suffix](path, data)
            num_read += 1
        except nacre.FileFormatError:
            pass
        except Exception as error:
            raise AssertionError(f"{error!r} with {data!r}") from error
    # Else nothing was compared; PNG has check sums.
    assert num_read >= (1 if suffix == ".png" else 50), num_read


def check_cloud(cloud):
    assert cloud.points.shape[1:] == (3,)
    assert cloud.shape is None or len(cloud.shape) == 2


def check_grid(grid):
    assert grid.shape is None or grid.ndim == 3


def check_mesh(mesh):
    triangles = mesh.triangles
    assert triangles.size == 0 or (triangles.min() >= 0 and triangles.max() < len(mesh.vertices))


SOUND = {
    "points": (nacre.read_points, check_cloud, (".ply", ".pcd")),
    "range grid": (read_range_grid, check_grid, (".ply",)),
    "mesh": (read_mesh_arrays, check_mesh, (".ply", ".obj", ".off", ".stl")),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("what", SOUND)
def test_what_no_other_reads_is_sound(tmp_path, what):
    """Of compressed points, range grids and meshes."""
    chance = random.Random(what)
    read, check, suffixes = SOUND[what]
    for suffix in suffixes:
        files = [case.files[case.opens] for case in VALID.values() if case.opens.endswith(suffix)]
        path = tmp_path / f"a{suffix}"
        for k in range(NUM_FILES // 2):
            data = (damaged, scratched)[k % 2](files, chance)
            path.write_bytes(data)
            try:
                check(read(path))
            except nacre.FileFormatError:
                pass
            except Exception as error:
                raise AssertionError(f"{error!r} with {data!r}") from error


BINARY = "binary.ply big.ply many.ply mixed.ply mixed_big.ply binary.pcd compressed.pcd fields.pcd full.pcd"


@pytest.mark.parametrize("name", BINARY.split())
def test_every_beginning_of_a_binary_file_is_refused(tmp_path, name):
    case = VALID[f"points/valid_{name}"]
    data = case.files[case.opens]
    path = tmp_path / name
    for size in range(len(data)):
        path.write_bytes(data[:size])
        with pytest.raises(nacre.FileFormatError):
            nacre.read_points(path)


@pytest.mark.data
def test_malformed_set(recordings):
    """An older set."""
    paths = sorted((recordings / "malformed-ply").glob("*.ply"))
    assert len(paths) == 16
    for path in paths:
        if path.name in ("nan.ply", "ok.ply"):
            nacre.read_points(path)
        else:
            with pytest.raises(nacre.FileFormatError):
                nacre.read_points(path)
