"""The steps of a run, as who listens to one is told of them."""

import numpy as np
import pytest
from test_wide_views import view

import nacre
from nacre.reconstruction import Reconstruction
from nacre.reconstruction.runner import Run
from nacre.reconstruction.steps import FrameDone, StageBegun


def frames(depths: list[np.ndarray], camera: nacre.Camera) -> list[nacre.SequenceFrame]:
    return [nacre.SequenceFrame(i, depth, camera, None, None, None) for i, depth in enumerate(depths)]


def short(step: object) -> object:
    return step.frame.index if isinstance(step, FrameDone) else step


def test_lost_frames_are_tried_again_at_the_end() -> None:
    camera = nacre.default_camera(nacre.built_in_object())
    recording = frames([view(0), view(180), view(15), view(60), view(120)], camera)
    run = Run(Reconstruction(recording, nacre.Model(camera)), range(5))
    steps = [short(step) for step in run.steps()]
    assert steps[:7] == [StageBegun("frames", 5), 0, 1, 2, 3, 4, StageBegun("lost frames", 1)]
    assert set(steps[7:]) == {1}
    assert run.done.counts["LOST"] == 0


def test_what_is_done_is_left_out_of_a_sequence_and_others_are_taken_as_they_come() -> None:
    camera = nacre.default_camera(nacre.built_in_object())
    done = Reconstruction(frames([view(0), view(15), view(30)], camera), nacre.Model(camera))
    next(iter(done.run([0])))
    assert [short(s) for s in Run(done, range(2), retry=False).steps()] == [StageBegun("frames", 1), 1]
    assert list(Run(done, range(2), retry=False).steps()) == []
    steps = Run(done, iter([2]), retry=False).steps()
    assert [short(step) for step in steps] == [StageBegun("frames"), 2]


def test_coarse_depth_is_said(caplog: pytest.LogCaptureFixture) -> None:
    camera = nacre.default_camera(nacre.built_in_object())
    fine = [view(angle) for angle in (0, 15, 30)]
    coarse = [np.round(depth / 0.005).astype(np.float32) * np.float32(0.005) for depth in fine]
    with caplog.at_level("WARNING", logger="nacre"):
        good = nacre.reconstruct(frames(fine, camera))
        assert good.advice == []
        assert not caplog.records
        done = nacre.reconstruct(frames(coarse, camera))
    assert done.model.depth_unit == pytest.approx(0.005, rel=1e-5)
    (sentence,) = done.advice
    assert sentence.startswith("depth comes in steps of 5 mm")
    assert [record.message for record in caplog.records] == [sentence]
