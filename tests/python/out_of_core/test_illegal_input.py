"""What cannot be done is told at once, and what was there before stays."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hills import CELLS, hills, write

import nacre
from nacre import out_of_core
from nacre.out_of_core import run
from nacre.out_of_core.memory import as_bytes


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        ("consolidate", {"num_points": 0}, "num_points must be an integer .*at least 1"),
        ("consolidate", {"num_points": 10, "radius": 0.0}, "radius must be"),
        ("consolidate", {"num_points": 10, "mu": 0.7}, "mu must be"),
        ("consolidate", {"num_points": 10, "method": "mlop"}, "method must be"),
        ("consolidate", {"num_points": 10, "seed": -1}, "seed must be"),
        ("estimate_normals", {"k": 2}, "k must be"),
        ("estimate_normals", {"max_radius": 0.0}, "max_radius must be"),
        ("estimate_normals", {"viewpoint": (0, 0)}, "viewpoint must"),
        ("estimate_normals", {"memory": "2 pounds"}, "memory must be a size such as 2GB"),
        ("estimate_normals", {"memory": 1000}, "memory must be at least 500MB, got 1000 bytes"),
        ("estimate_normals", {"memory": 1.5}, "memory must be a number of bytes"),
        ("estimate_normals", {"workers": 0}, "workers must be"),
        ("estimate_normals", {"scheduler": 8786}, "scheduler must be an address"),
        ("estimate_normals", {"points_per_cell": 0}, "points_per_cell must be"),
        ("estimate_normals", {"cells_per_task": 0}, "cells_per_task must be"),
        ("estimate_normals", {"output": "a.xyz"}, "output must end in .ply, .pcd, .las, .laz"),
        ("voxel_downsample", {"voxel_size": 0.0}, "voxel_size must be positive"),
        ("voxel_downsample", {"voxel_size": 1e-320}, "voxel_size must not be so small"),
        ("remove_outliers", {"k": 0}, "k must be"),
        ("remove_outliers", {"std_ratio": -1.0}, "std_ratio must be"),
        ("remove_outliers", {"max_radius": np.inf}, "max_radius must be positive and finite"),
        ("align", {"target": "nothing.obj"}, "point files end in"),
    ],
)
def test_arguments(
    function: str, arguments: dict[str, Any], message: str, scan: Path, tmp_path: Path
) -> None:
    options = {"output": tmp_path / "o.ply", **arguments}
    with pytest.raises((TypeError, ValueError), match=message):
        getattr(out_of_core, function)(scan, **options)
    assert list(tmp_path.iterdir()) == []


def test_sources(tmp_path: Path) -> None:
    out = tmp_path / "o.ply"
    with pytest.raises(FileNotFoundError):
        out_of_core.estimate_normals(tmp_path / "no.ply", out)
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileNotFoundError, match="no point file"):
        out_of_core.estimate_normals(tmp_path / "empty", out)
    with pytest.raises(
        ValueError, match="source must be a point file, a folder of them, or several, got none"
    ):
        out_of_core.estimate_normals([], out)
    nan = write(tmp_path / "nan.ply", nacre.Cloud(np.full((5, 3), np.nan)))
    with pytest.raises(ValueError, match=r"nan\.ply: there is no finite point"):
        out_of_core.estimate_normals(nan, out)
    same = write(tmp_path / "same.ply", nacre.Cloud(np.ones((50, 3))))
    with pytest.raises(ValueError, match="max_radius must be given"):
        out_of_core.estimate_normals(same, out)
    with pytest.raises(ValueError, match="radius must be given"):
        out_of_core.consolidate(same, out, num_points=5)
    with pytest.raises(nacre.FileFormatError, match="its fields must be those of the first file"):
        out_of_core.estimate_normals([same, write(tmp_path / "more.ply", hills(10))], out)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".las", ".laz"])
def test_files_that_are_cut_short(suffix: str, tmp_path: Path) -> None:
    if suffix in (".las", ".laz"):
        pytest.importorskip("laspy")
    whole = write(tmp_path / f"a{suffix}", hills(3000)).read_bytes()
    (tmp_path / f"a{suffix}").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(nacre.FileFormatError, match=f"a{suffix}"):
        out_of_core.estimate_normals(tmp_path / f"a{suffix}", tmp_path / "o.ply")
    assert not (tmp_path / "o.ply").exists()


def test_texts_are_read_where_memory_holds_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = write(tmp_path / "a.xyz", hills(300))
    assert out_of_core.estimate_normals(text, tmp_path / "o.ply").num_points == 300
    monkeypatch.setattr("nacre.out_of_core.survey._BYTES_PER_BYTE", 10**6)
    with pytest.raises(ValueError, match="must be of a kind that can be read in pieces"):
        out_of_core.estimate_normals(text, tmp_path / "o.ply", memory="1GB")


def test_points_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    points = hills(2000).points
    points[::100] = np.nan
    result = out_of_core.estimate_normals(write(tmp_path / "a.ply", nacre.Cloud(points)), tmp_path / "o.ply")
    assert (result.num_input, result.num_left_out, result.num_points) == (2000, 20, 1980)


def test_memory_that_does_not_hold_a_cell(
    scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "PER_PROCESS", 10**9)
    with pytest.raises(
        ValueError, match=r"memory must be at least 1\.0\dGB for the \d+ points of the largest"
    ):
        out_of_core.estimate_normals(scan, tmp_path / "o.ply", **CELLS)


def test_as_many_workers_as_memory_holds(
    scan: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    out_of_core.estimate_normals(scan, tmp_path / "o.ply", workers=50, **{**CELLS, "memory": "750MB"})
    assert "memory holds 1 of 50 workers" in caplog.text


def test_a_full_disk_leaves_what_was_there(
    scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "o.ply").write_text("of yesterday")
    monkeypatch.setattr(run, "_work_on", full)
    with pytest.raises(OSError, match=r"No space left on device.*o\.ply"):
        out_of_core.estimate_normals(scan, tmp_path / "o.ply", **CELLS)
    assert [path.name for path in tmp_path.iterdir()] == ["o.ply"]
    assert (tmp_path / "o.ply").read_text() == "of yesterday"


def test_a_scheduler_that_goes_away(scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")

    def gone() -> None:
        raise distributed.CancelledError

    @contextmanager
    def cluster_client(*_: object) -> Iterator[SimpleNamespace]:
        yield SimpleNamespace(map=lambda *_, **__: [SimpleNamespace(result=gone)])

    monkeypatch.setattr("nacre._internal.cluster.cluster_client", cluster_client)
    monkeypatch.setattr(distributed, "as_completed", iter)
    with pytest.raises(ConnectionError, match="scheduler went away; nothing was written, the same command"):
        out_of_core.estimate_normals(scan, tmp_path / "o.ply", scheduler="tcp://10.0.0.1:8786", **CELLS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "number"),
    [("2GB", 2 * 10**9), ("512 MiB", 512 << 20), ("1.5g", 1_500_000_000), ("600000000", 600_000_000)],
)
def test_sizes(text: str, number: int) -> None:
    assert as_bytes("memory", text) == number
