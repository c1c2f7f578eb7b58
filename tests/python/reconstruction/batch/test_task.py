"""One recording of a batch, without a cluster: what is done again, what goes on, and what is refused."""

from __future__ import annotations

import dataclasses
import errno
import os
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("typer")
from killed_runs import command, killed_after, results

import nacre
from nacre.io.folder_lock import lock_folder
from nacre.io.images import write_color_png
from nacre.reconstruction.batch.task import Task, make_tasks, reconstruct_recording
from nacre.reconstruction.journal import read_journal
from nacre.reconstruction.run_options import RunOptions

MakeTask = Callable[..., Task]


@pytest.fixture(name="task_for")
def make_task(scans: Path, tmp_path: Path) -> MakeTask:
    """Return what makes the task of a recording, whose results go to ``tmp_path``."""

    def task_for(name: str = "cup", *, overwrite: bool = False, **options: Any) -> Task:
        given = RunOptions(**{"source": "", "report": False, **options})
        (task,) = make_tasks(
            {name: scans / name}, given, nacre.ModelParameters(), tmp_path, overwrite=overwrite
        )
        return task

    return task_for


def test_it_writes_what_nacre_reconstruct_writes(task_for: MakeTask, alone: Any, tmp_path: Path) -> None:
    result = reconstruct_recording(task_for())
    assert results(tmp_path / "cup") == alone["cup"]
    assert sorted(path.name for path in (tmp_path / "cup").iterdir()) == [
        "model.ply",
        "report.json",
        "trajectory.txt",
    ]
    assert (result.outcome, result.level, result.message) == ("reconstructed", "ok", "")
    assert (result.num_frames, result.num_tracked) == (8, 8)
    assert result.trajectory_error is not None
    assert result.trajectory_error < 0.005
    assert (tmp_path / "thumbnails" / "cup.webp").read_bytes()[8:12] == b"WEBP"


def masked_times(page: str) -> str:
    """Return a report without the section of times, and with every duration masked."""
    page = re.sub(r'<details class="section"><summary><h2>Time.*?</details>', "", page, flags=re.DOTALL)
    return re.sub(r"[\d.]+ m?s\b", "TIME", page)


def test_the_report_is_the_same_but_for_times(task_for: MakeTask, scans: Path, tmp_path: Path) -> None:
    reconstruct_recording(task_for(report=True))
    assert command("reconstruct", scans / "cup", "-o", tmp_path / "alone")[0] == 0
    batch, alone = ((tmp_path / name / "report.html").read_text() for name in ("cup", "alone"))
    assert masked_times(batch) == masked_times(alone)


def test_what_is_finished_is_left_as_it_is(task_for: MakeTask, tmp_path: Path) -> None:
    first = reconstruct_recording(task_for())
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")}
    again = reconstruct_recording(task_for())
    assert again == dataclasses.replace(first, outcome="finished before")
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")} == before


def test_what_nacre_reconstruct_finished_counts(task_for: MakeTask, scans: Path, tmp_path: Path) -> None:
    command("reconstruct", scans / "cup", "-o", tmp_path / "cup", "--no-report")
    assert reconstruct_recording(task_for()).outcome == "finished before"


def test_what_is_finished_without_a_pose_has_no_trajectory(tmp_path: Path) -> None:
    camera = nacre.Camera(64, 48, 50, 50, 31.5, 23.5)
    nacre.write_recording(tmp_path / "dark", camera, np.zeros((2, 48, 64)), depth_scale=1000)
    options = RunOptions(source="", report=False)
    (task,) = make_tasks({"dark": tmp_path / "dark"}, options, nacre.ModelParameters(), tmp_path / "out")
    first = reconstruct_recording(task)
    assert (first.num_frames, first.num_tracked) == (2, 0)
    assert not (tmp_path / "out" / "dark" / "trajectory.txt").exists()
    assert reconstruct_recording(task).outcome == "finished before"


@pytest.mark.parametrize("name", ["model.ply", "trajectory.txt"])
def test_a_file_that_is_missing_is_made_again(
    task_for: MakeTask, alone: Any, tmp_path: Path, name: str
) -> None:
    reconstruct_recording(task_for())
    (tmp_path / "cup" / name).unlink()
    assert reconstruct_recording(task_for()).outcome == "reconstructed"
    assert results(tmp_path / "cup") == alone["cup"]


def test_what_was_killed_goes_on_to_the_same_bytes(
    task_for: MakeTask, scans: Path, alone: Any, tmp_path: Path
) -> None:
    out = tmp_path / "cup"
    killed_after(5, "reconstruct", scans / "cup", "-o", out, "--no-report", "--checkpoint-every", "2")
    assert len(read_journal(out / "unfinished" / "journal.txt")[0]) == 5
    assert reconstruct_recording(task_for()).outcome == "resumed"
    assert results(out) == alone["cup"]
    assert not (out / "unfinished").exists()


def test_other_options_are_said_and_not_skipped(task_for: MakeTask, tmp_path: Path) -> None:
    reconstruct_recording(task_for())
    before = results(tmp_path / "cup")
    result = reconstruct_recording(task_for(every=2))
    assert result.outcome == "failed"
    assert result.message == "it was done with other options: every was 1, is 2; overwrite begins it again"
    assert results(tmp_path / "cup") == before
    assert reconstruct_recording(task_for(every=2, overwrite=True)).num_frames == 4


def test_other_options_of_what_was_killed_are_said_too(
    task_for: MakeTask, scans: Path, tmp_path: Path
) -> None:
    killed_after(2, "reconstruct", scans / "cup", "-o", tmp_path / "cup", "--no-report", "--max-depth", "3")
    result = reconstruct_recording(task_for())
    assert result.message.startswith(
        "it was begun with other options: parameters was {'depth.max_depth': 3.0}"
    )
    assert reconstruct_recording(task_for(overwrite=True)).outcome == "reconstructed"


@pytest.mark.parametrize("file", ["report.json", "unfinished/run.json"])
def test_damaged_files_are_told_and_replaced_if_wanted(task_for: MakeTask, tmp_path: Path, file: str) -> None:
    reconstruct_recording(task_for())
    path = tmp_path / "cup" / file
    path.parent.mkdir(exist_ok=True)
    path.write_text('{"cut short')
    result = reconstruct_recording(task_for())
    assert result.outcome == "failed"
    assert file in result.message
    assert result.message.endswith("overwrite begins it again")
    assert path.read_text() == '{"cut short'
    assert reconstruct_recording(task_for(overwrite=True)).outcome == "reconstructed"


def test_what_cannot_go_on_is_told_and_begun_again_if_wanted(
    task_for: MakeTask, scans: Path, alone: Any, tmp_path: Path
) -> None:
    killed_after(4, "reconstruct", scans / "cup", "-o", tmp_path / "cup", "--no-report")
    checkpoint = tmp_path / "cup" / "unfinished" / "checkpoint"
    checkpoint.write_bytes(checkpoint.read_bytes()[:-100])
    result = reconstruct_recording(task_for())
    assert result.outcome == "failed"
    assert "unfinished/checkpoint" in result.message
    assert result.message.endswith("; overwrite begins it again")
    assert reconstruct_recording(task_for(overwrite=True)).outcome == "reconstructed"
    assert results(tmp_path / "cup") == alone["cup"]


def test_a_recording_that_fails_is_told_and_leaves_nothing(task_for: MakeTask, tmp_path: Path) -> None:
    result = reconstruct_recording(task_for("broken"))
    assert result.outcome == "failed"
    assert "depth.txt, line 1" in result.message
    assert reconstruct_recording(task_for("jug")).message.startswith("no such recording")
    assert list(tmp_path.iterdir()) == []


def test_too_few_tracked_frames_are_told_each_time(task_for: MakeTask, scans: Path) -> None:
    folder = scans / "mug" / "silhouettes"
    folder.mkdir()
    depth = sorted((scans / "mug" / "depth").iterdir())
    write_color_png(folder / f"{depth[5].stem}.png", np.zeros((60, 80, 3), np.uint8))
    task = task_for("mug", masks="silhouettes", min_tracked=1.0)
    for outcome in ("reconstructed", "finished before"):
        result = reconstruct_recording(task)
        assert (result.outcome, result.message) == (outcome, "only 7 of 8 frames were tracked")


def test_a_full_disk_is_left_to_the_cluster_which_tries_again(
    task_for: MakeTask, alone: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            reconstruct_recording(task_for())
    assert reconstruct_recording(task_for()).has_results
    assert results(tmp_path / "cup") == alone["cup"]


def test_a_folder_that_another_process_writes_to_is_waited_for(task_for: MakeTask, tmp_path: Path) -> None:
    reconstruct_recording(task_for())
    lock = lock_folder(tmp_path / "cup")
    if lock is None:
        pytest.skip("no locks here")
    found: list[Any] = []
    waiting = threading.Thread(target=lambda: found.append(reconstruct_recording(task_for())))
    waiting.start()
    waiting.join(0.3)
    assert waiting.is_alive()
    os.close(lock)
    waiting.join(300)
    assert found[0].outcome == "finished before"


def test_another_version_is_refused_for_it_may_give_other_bytes(task_for: MakeTask) -> None:
    result = reconstruct_recording(dataclasses.replace(task_for(), version="0.0.1"))
    assert result.message == f"the worker has nacre {nacre.__version__}, the batch 0.0.1"


def test_folders_of_images_begin_at_each_recording(task_for: MakeTask, scans: Path) -> None:
    options = task_for(masks="masks", attribute=["heat=thermal"]).options
    assert options.masks == str(scans / "cup" / "masks")
    assert options.attribute == [f"heat={scans / 'cup' / 'thermal'}"]


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"format": "tumm"}, ValueError, "format must be one of"),
        ({"camera": "no.json"}, FileNotFoundError, "no.json"),
        ({"every": 0}, ValueError, "every must be"),
        ({"first": -1}, ValueError, "first must be"),
        ({"last": 1.5}, TypeError, "last must be"),
        ({"depth_scale": float("nan")}, ValueError, "depth_scale must be"),
        ({"min_tracked": 2}, ValueError, "min_tracked must be 0 to 1"),
        ({"color": 1}, TypeError, "color must be"),
    ],
)
def test_options_that_no_recording_can_have_are_refused_before_anything_is_done(
    task_for: MakeTask, options: dict[str, Any], error: type[Exception], says: str, tmp_path: Path
) -> None:
    with pytest.raises(error, match=says):
        task_for(**options)
    assert list(tmp_path.iterdir()) == []


def test_a_camera_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="sources must be recordings, and realsense is a camera"):
        make_tasks({"realsense": Path("realsense")}, RunOptions(""), nacre.ModelParameters(), tmp_path)
