"""A recording in one call: progress, cancelling, and what is told through ``logging``."""

from __future__ import annotations

import itertools
import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.reconstruction import FrameRecord, Reconstruction

PACKAGE = Path(nacre.__file__).parent


@pytest.fixture(scope="module")
def frames() -> list[nacre.SequenceFrame]:
    mesh = nacre.built_in_object()
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    poses = nacre.turntable_poses(mesh, 5, 0.15, camera=camera, distance=0.3)
    return [
        nacre.SequenceFrame(i, mesh.simulate_depth(camera, pose, seed=i), camera, 0.1 * i, None, pose)
        for i, pose in enumerate(poses)
    ]


def test_one_call_makes_a_model_of_a_list_of_frames(frames: list[nacre.SequenceFrame]) -> None:
    done = nacre.reconstruct(frames, spacing=0.003)
    assert done.num_tracked == 5
    assert done.model.parameters.spacing == 0.003
    assert done.evaluation["absolute_trajectory_error"].rmse < 0.001
    assert repr(done).startswith("Reconstruction(5 of 5 frames done (5 TRACKED), ")


def test_a_path_is_opened(frames: list[nacre.SequenceFrame], tmp_path: Path) -> None:
    nacre.write_recording(tmp_path, frames[0].camera, (f.depth for f in frames), depth_scale=10000)
    done = nacre.reconstruct(tmp_path)
    assert done.num_tracked == 5
    assert not done.cancelled


def test_progress_gets_each_frame_when_it_is_done(frames: list[nacre.SequenceFrame]) -> None:
    told: list[FrameRecord] = []
    done = nacre.reconstruct(frames, progress=told.append)
    assert [record.index for record in told] == [0, 1, 2, 3, 4]
    assert told[-1].report is done.frames[-1].report


def test_whatever_holds_the_images_the_run_is_the_same(
    frames: list[nacre.SequenceFrame], tmp_path: Path
) -> None:
    camera = frames[0].camera
    nacre.write_recording(tmp_path, camera, (f.depth for f in frames), depth_scale=10000)
    recording = nacre.open_sequence(tmp_path)
    expected = nacre.reconstruct(recording).model.points
    depths = [frame.depth for frame in recording]
    files = sorted((tmp_path / "depth").glob("*.png"))
    for source, options in (
        (depths, {"camera": camera}),
        (np.stack(depths), {"camera": camera}),
        (iter(depths), {"camera": camera}),
        (iter(recording), {}),
        (files, {"camera": camera, "depth_scale": 10000}),
        (map(str, files), {"camera": tmp_path / "camera.json"}),
    ):
        assert np.array_equal(nacre.reconstruct(source, **options).model.points, expected)


def test_an_endless_source_ends_when_the_callback_says_so(frames: list[nacre.SequenceFrame]) -> None:
    endless = itertools.cycle(frame.depth for frame in frames)
    done = nacre.reconstruct(endless, camera=frames[0].camera, progress=lambda frame: frame.index < 3)
    assert done.cancelled
    assert len(done.frames) == len(done.sequence) == 4


def test_a_lost_frame_of_a_generator_is_gone_over_again(frames: list[nacre.SequenceFrame]) -> None:
    depths = [frames[i].depth for i in (0, 4, 1, 2, 3)]
    listed = nacre.reconstruct(depths, camera=frames[0].camera, relocalise=False)
    streamed = nacre.reconstruct(iter(depths), camera=frames[0].camera, relocalise=False)
    assert [frame.status for frame in streamed.frames] == [frame.status for frame in listed.frames]
    assert streamed.report_data("title", "memory").title == "title"


def test_where_every_frame_is_refused_the_reason_comes_out(frames: list[nacre.SequenceFrame]) -> None:
    millimetres = [1000 * frame.depth for frame in frames]
    with pytest.raises(ValueError, match=r"depth must be in metres .* check depth_scale"):
        nacre.reconstruct(millimetres, camera=frames[0].camera)
    done = nacre.reconstruct([millimetres[0], *(f.depth for f in frames)], camera=frames[0].camera)
    assert done.frames[0].status == "LOST"
    assert done.num_tracked == 5


@pytest.mark.parametrize("way", ["return False", "raise Cancelled"])
def test_a_cancelled_run_keeps_what_is_done(frames: list[nacre.SequenceFrame], way: str) -> None:
    def progress(record: FrameRecord) -> bool:
        if record.index == 2 and way.startswith("raise"):
            raise nacre.Cancelled
        return record.index < 2

    done = nacre.reconstruct(frames, progress=progress)
    assert done.cancelled
    assert len(done.frames) == 3
    assert repr(done).endswith("cancelled)")
    assert np.array_equal(done.model.points, nacre.reconstruct(frames[:3]).model.points)
    assert done.evaluation["absolute_trajectory_error"].num_compared == 3


def test_an_exception_of_the_callback_comes_out_and_what_is_done_is_kept(
    frames: list[nacre.SequenceFrame],
) -> None:
    done = Reconstruction(frames, nacre.Model(frames[0].camera))

    def progress(record: FrameRecord) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        done.complete(progress=progress)
    assert len(done.frames) == len(done.model.frames) == 1


@pytest.mark.parametrize(
    ("source", "arguments", "words"),
    [
        ([], {}, "source must have at least one frame"),
        (3, {}, "source must be a path or a sequence of frames, got int"),
        ("frames", {"depth_scale": 5}, "depth_scale is not for this source, its frames have their own"),
        ("frames", {"format": "tum"}, "format is not for this source, its frames have their own; got 'tum'"),
        ([np.ones((4, 4))], {"format": "tum"}, "format is not for this source, these are arrays"),
        ([np.ones((4, 4))], {"camera": 3}, "camera must be a nacre.Camera, got int"),
        (iter(()), {}, "source must have at least one frame, got none"),
        ("frames", {"progress": 5}, "progress must be a function or None, got 5"),
    ],
)
def test_misuse(frames: list[nacre.SequenceFrame], source: object, arguments: dict, words: str) -> None:
    with pytest.raises((TypeError, ValueError), match=words):
        nacre.reconstruct(frames if source == "frames" else source, **arguments)


def test_what_happens_is_logged(frames: list[nacre.SequenceFrame], caplog: pytest.LogCaptureFixture) -> None:
    nothing = nacre.SequenceFrame(
        9, np.full((120, 160), np.nan, np.float32), frames[0].camera, 9.0, None, None
    )
    with caplog.at_level(logging.DEBUG, "nacre"):
        nacre.reconstruct([*frames[:2], nothing, frames[2]], retry=False)
    told = [(record.levelname, record.getMessage()) for record in caplog.records]
    assert ("INFO", "frame 2: LOST: only 0 pixels of the frame are usable") in told
    assert ("INFO", "frame 3: RELOCALISED") in told
    assert sum(level == "DEBUG" for level, _ in told) == 4
    assert {record.name for record in caplog.records} == {"nacre.reconstruction"}


def test_reports_have_the_poses_that_later_views_of_an_object_adjusted() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).resolve().parents[3] / "examples" / "python")
        from simulated import turntable
    done = nacre.reconstruct(list(turntable(6)), region={"object": True})
    expected = [done.model._core.report(i).world_from_camera for i in range(6)]
    assert np.array_equal([frame.world_from_camera for frame in done.frames], expected)
    assert np.array_equal(done.model.poses, expected)


def test_the_library_says_nothing_unless_asked() -> None:
    code = "import nacre, logging; logging.getLogger('nacre').warning('not seen')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout + done.stderr == ""


def test_only_the_command_line_prints() -> None:
    printing = [
        f"{path.relative_to(PACKAGE)}:{number}"
        for path in PACKAGE.rglob("*.py")
        if "cli" not in path.parts
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if "print(" in line and not line.lstrip().startswith((">>>", "...", "#"))
    ]
    assert printing == []
