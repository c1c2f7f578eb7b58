"""A recording cut into pieces that workers track: the same bytes whoever works."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre._internal import cluster as clusters
from nacre.reconstruction.pieces.cut import PIECE, SHARED, cut
from nacre.reconstruction.pieces.joint import joint
from nacre.reconstruction.pieces.track import Piece, read_poses, track, write_poses
from nacre.reconstruction.run_options import RunOptions

pytest.importorskip("typer")
distributed = pytest.importorskip("distributed")
from killed_runs import NACRE, command, results  # noqa: E402  they need the command line

SILENT = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
NUM_FRAMES = 150  # three pieces, all around
CAMERA = nacre.Camera(width=80, height=60, fx=65.5, fy=65.5, cx=39.5, cy=29.5)


@pytest.fixture(scope="module", name="recording")
def once_around(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of the built-in object from all sides; the camera comes back to where it began."""
    return write_turn(tmp_path_factory.mktemp("pieces") / "object", CAMERA)


def write_turn(folder: Path, told: nacre.Camera) -> Path:
    """Write what CAMERA sees of the built-in object once around, as the recording of another one."""
    mesh = nacre.built_in_object()
    poses = nacre.turntable_poses(mesh, NUM_FRAMES, 2 * np.pi / (NUM_FRAMES - 10), camera=CAMERA)
    depths = [mesh.simulate_depth(CAMERA, pose, noise=0.0005, seed=k) for k, pose in enumerate(poses)]
    nacre.write_recording(folder, told, depths, depth_scale=20000, poses=poses)
    return folder


@pytest.fixture(scope="module", name="in_pieces")
def by_two_workers(cluster: Any, recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return what two workers leave who are not disturbed."""
    out = tmp_path_factory.mktemp("pieces") / "out"
    code, _, said = run(recording, out, "--scheduler", cluster.scheduler_address)
    assert code == 0, said
    assert not (out / "unfinished").exists()
    return results(out)


def run(recording: Path, out: Path, *more: Any) -> tuple[int, str, str]:
    return command("reconstruct", recording, "-o", out, "--no-report", *more)


def wait_until(happens: Callable[[], bool]) -> None:
    end = time.monotonic() + 300
    while not happens():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)


@pytest.mark.parametrize("count", [1, PIECE, PIECE + 1, 2 * PIECE - SHARED, 1000])
def test_pieces_hold_every_frame_and_neighbours_share_some(count: int) -> None:
    pieces = cut(range(0, 2 * count, 2))
    assert sorted({index for piece in pieces for index in piece}) == list(range(0, 2 * count, 2))
    for first, second in itertools.pairwise(pieces):
        assert list(first[-SHARED:]) == list(second[:SHARED])
        assert len(second) > SHARED


def test_a_frame_that_one_piece_has_wrong_does_not_count_where_they_are_joined() -> None:
    rng = np.random.default_rng(0)
    first_from_second = nacre.turntable_poses(nacre.built_in_object(), 2, 0.7)[1]
    second = {index: np.eye(4) for index in range(SHARED)}
    for index, pose in second.items():
        pose[:3, 3] = (0.01 * index, 0, 0)
    first = {index: first_from_second @ pose for index, pose in second.items()}
    for pose in first.values():
        pose[:3, 3] += rng.normal(0, 0.001, 3)
    first[4][:3, 3] += 1.0
    found = joint(first, second)
    assert found is not None
    np.testing.assert_allclose(found, first_from_second, atol=0.0015)
    assert joint({1: np.eye(4)}, {2: np.eye(4)}) is None


def test_poses_are_kept_to_the_bit_and_damage_is_told(tmp_path: Path) -> None:
    poses = dict(enumerate(nacre.turntable_poses(nacre.built_in_object(), 3, 0.7)))
    write_poses(tmp_path / "piece.json", poses)
    found = read_poses(tmp_path / "piece.json")
    assert {index: pose.tobytes() for index, pose in found.items()} == {
        index: pose.tobytes() for index, pose in poses.items()
    }
    (tmp_path / "piece.json").write_text('{"1": [0]}')
    with pytest.raises(nacre.FileFormatError, match="does not hold the poses of a piece"):
        read_poses(tmp_path / "piece.json")


def test_points_of_a_piece_leave_memory_for_a_while(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera goes along a wall; without leaving, points would be fewer where they may not be as many."""
    x, y = np.meshgrid(np.linspace(-1, 9, 301), np.linspace(-1.2, 1.2, 73))
    z = 1.5 + 0.1 * np.sin(3 * x + np.sin(5 * y)) + 0.08 * np.cos(4 * y + x * x)
    corners = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (
        part.ravel() for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:])
    )
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    mesh = nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), triangles)
    poses = np.tile(np.eye(4), (PIECE, 1, 1))
    poses[:, 0, 3] = np.linspace(0, 8, PIECE)
    depths = [mesh.simulate_depth(CAMERA, pose, noise=0.001, seed=k) for k, pose in enumerate(poses)]
    nacre.write_recording(tmp_path / "wall", CAMERA, depths, depth_scale=10000)
    (tmp_path / "parked").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "parked"))

    def found(max_points: int) -> dict[int, bytes]:
        parameters = nacre.ModelParameters(max_points=max_points)
        piece = Piece(RunOptions("wall"), tmp_path, parameters, range(PIECE))
        return {index: pose.tobytes() for index, pose in track(piece).items()}

    poses_of_all = found(500_000)
    assert len(poses_of_all) == PIECE
    assert found(4_000) == poses_of_all
    assert list((tmp_path / "parked").iterdir()) == []


def test_it_is_nearly_as_good_as_in_one_go(recording: Path, in_pieces: Any, tmp_path: Path) -> None:
    """Poses of a piece are those of a model that fewer frames have averaged; docs/scaling.md has figures."""
    assert run(recording, tmp_path / "o")[0] == 0
    alone = json.loads((tmp_path / "o" / "report.json").read_text())
    pieces = in_pieces[2]
    assert all(frame["status"] == "TRACKED" for frame in pieces["frames"])
    errors = [report["absolute_trajectory_error"]["rmse"] for report in (pieces, alone)]
    assert errors[0] <= 2 * errors[1], errors


def test_loops_between_pieces_are_closed(cluster: Any, tmp_path: Path) -> None:
    """A focal length that is told wrongly makes the turn not close."""
    told = nacre.Camera(width=80, height=60, fx=69, fy=69, cx=39.5, cy=29.5)
    recording = write_turn(tmp_path / "object", told)
    assert run(recording, tmp_path / "out", "--scheduler", cluster.scheduler_address)[0] == 0
    loops = [frame for frame in results(tmp_path / "out")[2]["frames"] if frame["loop_frame"] is not None]
    assert any(frame["index"] >= PIECE > frame["loop_frame"] for frame in loops)


def test_only_a_pose_that_is_kept_is_movable(recording: Path) -> None:
    first = nacre.open_sequence(recording)[0]
    with pytest.raises(ValueError, match="movable must be used with a guess that is kept"):
        nacre.Model(first.camera).add_frame(first.depth, movable=True)


def test_the_bytes_do_not_depend_on_who_works(recording: Path, in_pieces: Any, tmp_path: Path) -> None:
    code, _, said = run(recording, tmp_path / "o", "--workers", 1)
    assert code == 0, said
    assert results(tmp_path / "o") == in_pieces


def test_python_gets_the_same(cluster: Any, recording: Path, in_pieces: Any, tmp_path: Path) -> None:
    done = nacre.reconstruct(recording, scheduler=cluster.scheduler_address)
    nacre.write_trajectory(tmp_path / "trajectory.txt", done.trajectory)
    assert (tmp_path / "trajectory.txt").read_bytes() == in_pieces[1]


def test_workers_that_are_killed_change_no_byte(
    cluster: Any, recording: Path, in_pieces: Any, tmp_path: Path
) -> None:
    with distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        pids = list(client.run(os.getpid).values())
    words = [*NACRE, "reconstruct", recording, "-o", tmp_path, "--no-report"]
    words += ["--scheduler", cluster.scheduler_address]
    begun = subprocess.Popen(
        [str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    wait_until((tmp_path / "unfinished" / "journal.txt").exists)
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
    said = begun.communicate(timeout=300)[0]
    assert begun.returncode == 0, said
    assert results(tmp_path) == in_pieces


def test_a_run_whose_scheduler_goes_away_says_what_is_missing_and_goes_on(
    recording: Path, in_pieces: Any, tmp_path: Path
) -> None:
    file, out = tmp_path / "scheduler.json", tmp_path / "out"
    dask = [sys.executable, "-m", "dask", "scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler = subprocess.Popen([*dask, "--no-dashboard", "--scheduler-file", str(file)], **SILENT)
    try:
        wait_until(lambda: file.exists() and file.stat().st_size > 0)
        words = [*NACRE, "reconstruct", recording, "-o", out, "--no-report", "--checkpoint-every", 20]
        words += ["--scheduler", json.loads(file.read_text())["address"]]
        begun = subprocess.Popen(
            [str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        journal = out / "unfinished" / "journal.txt"
        wait_until(lambda: journal.exists() and journal.stat().st_size > 0)  # it has no workers, and waits
    finally:
        scheduler.kill()
        scheduler.wait()
    said = begun.communicate(timeout=300)[0]
    assert begun.returncode == 1, said
    assert f"--resume {out} goes on where workers are there" in said
    assert "frames 50 to 109" in said
    code, _, told = command("reconstruct", "--resume", out, "--workers", 2)
    assert code == 0, told
    assert results(out) == in_pieces


def test_what_cannot_be_joined_is_lost_and_nothing_of_it_is_folded_in(
    cluster: Any, recording: Path, tmp_path: Path
) -> None:
    """The first camera sees the object; then it sees nothing for a while, and then another thing."""
    whole = nacre.open_sequence(recording)
    depths = [whole[index].depth for index in range(44)]
    depths += [np.full_like(depths[0], np.nan)] * 16
    step = np.where(np.arange(80) < 40, 0.5, 0.7).astype(np.float32)  # two walls, which determine no pose
    depths += [np.tile(step, (60, 1))] * 26
    nacre.write_recording(tmp_path / "broken", whole.camera, depths, depth_scale=20000)
    done = nacre.reconstruct(tmp_path / "broken", scheduler=cluster.scheduler_address)
    first = nacre.reconstruct([whole[index] for index in range(44)])
    assert [frame.status for frame in done.frames[:44]] == ["TRACKED"] * 44
    assert {frame.status for frame in done.frames[44:]} == {"LOST"}
    np.testing.assert_array_equal(done.model.points, first.model.points)


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"workers": 0}, ValueError, "workers must be"),
        ({"workers": "two"}, TypeError, "workers must be"),
        ({"scheduler": 8786}, TypeError, "scheduler must be an address, got 8786"),
        ({"workers": 1, "camera": nacre.Camera(80, 60, 65, 65, 40, 30)}, TypeError, "camera must be a file"),
    ],
)
def test_bad_arguments_are_told(
    options: dict[str, Any], error: type[Exception], says: str, recording: Path
) -> None:
    with pytest.raises(error, match=says):
        nacre.reconstruct(recording, **options)


def test_what_workers_cannot_open_is_told(recording: Path) -> None:
    with pytest.raises(TypeError, match="source must be a path where workers open it too, got"):
        nacre.reconstruct(nacre.open_sequence(recording), workers=2)


def test_nobody_at_the_address_is_told(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "_SECONDS_TO_CONNECT", 0.5)
    with pytest.raises(ConnectionError, match="no scheduler answers at"):
        nacre.reconstruct(recording, scheduler="tcp://127.0.0.1:1")


def test_frames_that_come_by_themselves_have_no_pieces(recording: Path, tmp_path: Path) -> None:
    code, _, said = run(recording, tmp_path / "o", "--realtime", "--workers", 2)
    assert code == 2
    assert "pieces are cut of a recording that is there" in said
