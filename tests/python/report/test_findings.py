"""What speaks against a run: each kind of failure is found where it is, and nowhere else."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from nacre.report import DoubledSurfaces, ModelCloud, ReportData, ReportedFrame
from nacre.report.deformation import deformation_figures
from nacre.report.motion_check import find_jumps
from nacre.report.summary import summarize
from nacre.report.verdict import Verdict

Array = npt.NDArray[np.float64]


def turned(degrees: float, x: float = 0.0, y: float = 0.0) -> Array:
    """A pose that is turned about the vertical axis."""
    angle, pose = math.radians(degrees), np.eye(4)
    pose[:3, :3] = [
        [math.cos(angle), 0, math.sin(angle)],
        [0, 1, 0],
        [-math.sin(angle), 0, math.cos(angle)],
    ]
    pose[:2, 3] = x, y
    return pose


def walk(number: int = 20, step: float = 2.0, truth: bool = False, **figures: Any) -> list[ReportedFrame]:
    """A camera that turns and moves evenly, with the unsteadiness of a hand."""
    shake = np.random.default_rng(0).normal(0, 0.2, (number, 2))
    poses = [turned(step * i + a, 0.03 * i + 0.01 * b) for i, (a, b) in enumerate(shake)]
    return [
        ReportedFrame(i, "TRACKED", world_from_camera=pose, truth=pose if truth else None, **figures)
        for i, pose in enumerate(poses)
    ]


def with_figures(frame: ReportedFrame, **figures: Any) -> ReportedFrame:
    return ReportedFrame(**frame.figures | figures)


def moved(frames: list[ReportedFrame], rows: range, motion: Array) -> list[ReportedFrame]:
    """The frames, of which some claim to be elsewhere."""
    return [
        with_figures(frame, world_from_camera=motion @ frame.world_from_camera) if i in rows else frame
        for i, frame in enumerate(frames)
    ]


def verdict_on(frames: list[ReportedFrame], **more: Any) -> Verdict:
    verdict = summarize(ReportData("x", frames=frames, **more)).verdict
    assert verdict is not None
    return verdict


def test_a_truth_that_is_near_is_told() -> None:
    assert verdict_on(walk(truth=True)).sentence == (
        "Good: all 20 frames were tracked, with a trajectory error of 0 mm."
    )


def test_a_camera_whose_numbers_are_doubted_is_not_good() -> None:
    verdict = verdict_on(walk(), camera_doubt="its focal length is wrong")
    assert (verdict.level, verdict.sentence) == ("weak", "Inaccurate: its focal length is wrong.")
    assert "--camera" in verdict.next_step


def test_what_doubles_surfaces_comes_before_them() -> None:
    doubled = DoubledSurfaces(0.2, 0.02, (0.0, 0.0, 1.0))
    verdict = verdict_on(walk(), camera_doubt="its depth is along the rays", doubled=doubled)
    assert [finding.kind for finding in verdict.findings] == ["camera", "doubled"]


def test_frames_that_came_too_fast_are_what_is_told_where_others_were_lost() -> None:
    assert verdict_on(walk(), num_dropped=9).level == "ok"
    frames = [
        with_figures(f, status="LOST", world_from_camera=None) if i > 5 else f for i, f in enumerate(walk())
    ]
    verdict = verdict_on(frames, num_dropped=40)
    assert [finding.kind for finding in verdict.findings] == ["untracked", "dropped"]
    assert "--max-depth" in verdict.next_step


class TestMotion:
    def test_a_steady_hand_is_good(self) -> None:
        assert verdict_on(walk()).level == "ok"

    @pytest.mark.parametrize("rows", [range(8, 9), range(8, 20), range(19, 20), range(1)])
    def test_half_a_turn_is_a_flip(self, rows: range) -> None:
        verdict = verdict_on(moved(walk(), rows, turned(180)))
        assert verdict.level == "lost"
        assert verdict.sentence.startswith("Wrong: the camera flips by 17")
        expected = {rows.start, rows.stop} & set(range(1, 20))
        assert set(verdict.findings[0].frames) == expected

    def test_a_turntable_that_flips(self) -> None:
        verdict = verdict_on(moved(walk(12, step=30), range(6, 12), turned(180)))
        assert verdict.findings[0].kind == "flip"
        assert verdict.findings[0].frames == (6,)

    def test_a_leap_to_the_side_is_a_jump(self) -> None:
        verdict = verdict_on(moved(walk(), range(10, 20), turned(0, x=0.5)))
        assert "the camera jumps by 531 mm and 1.89" in verdict.sentence
        assert verdict.findings[0].frames == (10,)

    def test_a_step_that_hardly_moves_what_is_seen_is_none(self) -> None:
        still = [ReportedFrame(i, "TRACKED", world_from_camera=turned(0)) for i in range(12)]
        frames = moved(still, range(6, 12), turned(0, x=0.04))
        assert not find_jumps(frames, distance_seen=1.0)
        assert find_jumps(frames, distance_seen=0.5)[0].ratio == math.inf
        sentence = verdict_on(frames, model=ModelCloud(np.array([[0, 0, 0.5]]))).sentence
        assert (
            "the camera jumps by 40.0 mm and 0\N{DEGREE SIGN} from frame 5 to 6, which stands still"
            in sentence
        )

    def test_where_directions_were_open_nothing_jumps(self) -> None:
        frames = moved(walk(), range(8, 12), turned(0, x=0.5))
        assert [jump.last for jump in find_jumps(frames)] == [8, 12]
        weak = [with_figures(f, status="WEAK") if 8 <= i < 12 else f for i, f in enumerate(frames)]
        assert not find_jumps(weak)
        verdict = verdict_on(weak)
        assert [finding.kind for finding in verdict.findings] == ["weak"]

    def test_a_camera_that_begins_to_move_does_not_jump(self) -> None:
        frames = [
            ReportedFrame(i, "TRACKED", world_from_camera=turned(0.5 * max(i - 10, 0) ** 2))
            for i in range(20)
        ]
        assert not find_jumps(frames)

    def test_views_in_any_order_have_no_motion_to_be_held_against(self) -> None:
        angles = np.random.default_rng(1).permutation(36) * 10
        frames = [ReportedFrame(i, "TRACKED", world_from_camera=turned(a)) for i, a in enumerate(angles)]
        assert not find_jumps(frames)

    @pytest.mark.parametrize("timed", [True, False])
    def test_a_step_counts_by_the_time_that_it_takes(self, timed: bool) -> None:
        frames = [with_figures(frame, timestamp=0.1 * frame.index) for frame in walk(30)]
        frames = frames[:12] + frames[20:]  # what lies between was not read
        if not timed:
            frames = [with_figures(frame, timestamp=None) for frame in frames]
        assert not find_jumps(frames)

    def test_a_clock_that_jitters_makes_no_jump(self) -> None:
        times = 0.1 * np.arange(20)
        times[12] = times[11] + 0.002
        frames = [with_figures(frame, timestamp=float(times[frame.index])) for frame in walk()]
        assert not find_jumps(frames)


class TestTruth:
    def test_drift_beyond_a_twentieth_is_wrong(self) -> None:
        frames = walk(truth=True)
        bent = [
            with_figures(f, world_from_camera=turned(0.5 * i) @ f.world_from_camera)
            for i, f in enumerate(frames)
        ]
        verdict = verdict_on(bent)
        assert verdict.level == "lost"
        assert verdict.findings[0].kind == "trajectory"
        assert "of 20 poses depart from the truth, by up to" in verdict.sentence

    @pytest.mark.parametrize("degrees", [0.0, 50.0])
    def test_two_poses_are_too_few_to_align_but_have_a_motion(self, degrees: float) -> None:
        frames = walk(2, truth=True)
        frames[1] = with_figures(frames[1], world_from_camera=turned(degrees) @ frames[1].world_from_camera)
        verdict = verdict_on(frames)
        assert (verdict.level == "lost") == (degrees > 0)
        if degrees:
            assert "the motion between the two known poses departs from the truth by" in verdict.sentence

    def test_what_looks_the_same_from_two_sides_is_said_to(self) -> None:
        bent = [
            with_figures(f, world_from_camera=turned(9 * f.index) @ f.world_from_camera)
            for f in walk(truth=True)
        ]
        verdict = verdict_on(bent)
        assert verdict.findings[0].kind == "trajectory"
        assert "does the scene look the same from there?" in verdict.next_step

    def test_a_few_wrong_poses_are_named(self) -> None:
        frames = walk(40, truth=True)
        verdict = verdict_on(moved(frames, range(20, 22), turned(0, y=0.07)))
        assert (verdict.level, verdict.findings[0].frames) == ("weak", (20, 21))
        assert verdict.sentence.startswith("Wrong in part: 2 of 40 poses depart")

    def test_the_distance_of_what_is_seen_is_a_scale_too(self) -> None:
        frames = moved(walk(40, truth=True), range(20, 22), turned(0, y=0.07))
        far = ModelCloud(np.array([[0, 0, 5.0], [0, 1, 5.0]]))
        assert verdict_on(frames, model=far).level == "ok"

    @pytest.mark.parametrize("num_tracked", [0, 1, 2, 3])
    def test_fewer_than_three_poses_tell_no_error(self, num_tracked: int) -> None:
        frames = [
            frame if i < num_tracked else with_figures(frame, status="LOST", world_from_camera=None)
            for i, frame in enumerate(walk(48, truth=True))
        ]
        tiles = {tile.label: tile for tile in summarize(ReportData("x", frames=frames)).tiles}
        told = tiles["Trajectory error (ATE)"]
        assert (told.value == "not known") == (num_tracked < 3)
        assert f"{num_tracked} of 48 frames" in told.note


def bent(number: int = 20, explained: float = 0.95, strain: float = 0.02, **more: Any) -> list[ReportedFrame]:
    """A walk about a thing that bends more and more; the first frame has nothing to be registered to."""
    return [
        with_figures(
            frame,
            num_inliers=900 if i else 0,
            deformation={
                "num_nodes": 50 + i,
                "explained": explained if i else 0.0,
                "strain": strain * i / number,
            },
        )
        for i, frame in enumerate(walk(number, **more))
    ]


class TestWhatBends:
    def test_its_figures(self) -> None:
        figures = deformation_figures(bent(21))
        assert figures is not None
        assert (figures.num_nodes, figures.num_bent, figures.explained) == (70, 20, 0.95)
        assert figures.strain_median == pytest.approx(0.02 * 10 / 21)
        assert figures.strain_max == pytest.approx(0.02 * 20 / 21)
        assert deformation_figures(walk()) is None

    def test_what_lost_frames_claim_does_not_count(self) -> None:
        frames = bent()
        frames[5] = with_figures(
            frames[5], status="LOST", deformation={"num_nodes": 99, "explained": 0.1, "strain": 0.5}
        )
        figures = deformation_figures(frames)
        assert figures is not None
        assert (figures.num_nodes, figures.num_bent) == (69, 18)
        assert figures.strain_max < 0.02

    def test_frames_that_bent_it_do_not_vouch_for_it(self) -> None:
        verdict = verdict_on(bent())
        assert verdict.level == "ok"
        assert "nothing contradicts" not in verdict.sentence
        assert verdict.sentence == (
            "Good: all 20 frames were tracked, and show 95.0 % of the points in view (median); "
            "what they do not show may be off."
        )

    def test_what_was_never_bent_is_judged_as_rigid(self) -> None:
        assert verdict_on(bent(strain=0.0)).sentence == verdict_on(walk()).sentence

    def test_frames_that_show_little_of_it_are_named(self) -> None:
        frames = bent()
        figures = {"num_nodes": 60, "explained": 0.6, "strain": 0.02}
        frames[8:10] = [with_figures(frame, deformation=figures) for frame in frames[8:10]]
        verdict = verdict_on(frames)
        assert (verdict.level, verdict.findings[0].kind, verdict.findings[0].frames) == (
            "weak",
            "unexplained",
            (8, 9),
        )
        assert verdict.sentence == (
            "Doubtful: 2 frames show down to 60.0 % of the points in view where they were bent to "
            "(frames 8 to 9)."
        )
        assert "animation.glb" in verdict.next_step

    def test_lost_frames_count(self) -> None:
        frames = [
            with_figures(frame, status="LOST", world_from_camera=None) if frame.index in (4, 5, 6) else frame
            for frame in bent()
        ]
        assert verdict_on(frames).sentence.startswith("Incomplete: 3 of 20 frames were lost")
        assert verdict_on(frames, min_tracked=0.9).level == "lost"

    def test_the_truth_of_the_camera_is_not_that_of_one_relative_to_the_shape(self) -> None:
        def turned_away(frames: list[ReportedFrame]) -> list[ReportedFrame]:
            poses = [turned(2.0 * frame.index) @ frame.world_from_camera for frame in frames]
            return [
                with_figures(frame, world_from_camera=pose) for frame, pose in zip(frames, poses, strict=True)
            ]

        assert verdict_on(turned_away(walk(truth=True))).level == "lost"
        frames = turned_away(bent(truth=True))
        assert verdict_on(frames).level == "ok"
        tiles = {tile.label: tile for tile in summarize(ReportData("x", frames=frames)).tiles}
        assert "of a camera relative to the shape" in tiles["Trajectory error (ATE)"].note

    def test_noise_is_not_all_that_moves_its_points(self) -> None:
        cloud = ModelCloud(np.array([[0, 0, 1.0], [0, 1, 1.0]]), sigma=np.array([0.001, 0.002]))

        def note(frames: list[ReportedFrame]) -> str:
            tiles = summarize(ReportData("x", frames=frames, model=cloud)).tiles
            return next(tile.note for tile in tiles if tile.label == "Point standard deviation")

        assert "without the error of the warp" in note(bent())
        assert "warp" not in note(walk())


class TestFrames:
    def test_less_than_the_part_that_is_asked_for_has_failed(self) -> None:
        lost = [
            with_figures(frame, status="LOST", reason="plane") if i % 2 else frame
            for i, frame in enumerate(walk(20))
        ]
        assert verdict_on(lost).sentence.startswith("Incomplete: 10 of 20 frames were lost: plane")
        failed = verdict_on(lost, min_tracked=0.6)
        assert (failed.level, failed.findings[0].kind) == ("lost", "untracked")
        assert "only 10 of 20 frames (50.0 %) were tracked" in failed.sentence

    @pytest.mark.parametrize(
        ("reason", "advice"),
        [
            (
                "registration score 0.1 is below 0.3, all but 0.1 on three planes",
                "overlap what was seen",
            ),
            ("there is no plane on which anything stands", "does a thing stand on a plane"),
            ("only 3 pixels of the frame", "Hardly a pixel was left after cleaning"),
        ],
    )
    def test_each_cause_has_its_advice(self, reason: str, advice: str) -> None:
        depth = {"num_pixels": 100, "num_invalid": 10}
        frames = walk(depth=depth)
        frames[3] = with_figures(frames[3], status="LOST", reason=reason)
        assert advice in verdict_on(frames).next_step

    def test_open_directions_are_told_with_what_helps(self) -> None:
        frames = walk()
        frames[5] = with_figures(frames[5], status="WEAK")
        verdict = verdict_on(frames)
        assert "1 frame was not fused, as the shape in view leaves directions" in verdict.sentence
        assert "corners or texture" in verdict.next_step

    def test_doubtful_registrations_are_named(self) -> None:
        frames = [with_figures(f, probability=0.9 if f.index == 7 else 0.99) for f in walk()]
        verdict = verdict_on(frames)
        assert verdict.findings[0].frames == (7,)
        assert "down to 90.0 % (frame 7)" in verdict.sentence

    def test_the_worst_comes_first_and_nothing_is_left_out(self) -> None:
        frames = moved(walk(), range(10, 20), turned(180))
        frames[3] = with_figures(frames[3], status="LOST", world_from_camera=None)
        doubled = DoubledSurfaces(0.02, 0.007, (0.0, 0.0, 1.0))
        verdict = verdict_on(frames, doubled=doubled, interrupted=True)
        assert [finding.kind for finding in verdict.findings] == ["flip", "doubled", "lost", "interrupted"]
        assert verdict.findings[1].statement == (
            "2.0 % of the surface is there twice, 7.00 mm apart, around (0 mm, 0 mm, 1.00 m)"
        )
        assert verdict.level == "lost"

    def test_findings_are_plain_values(self) -> None:
        lost = [with_figures(frame, status="LOST", world_from_camera=None) for frame in walk(3)]
        document = dataclasses.asdict(verdict_on(lost))
        assert document["findings"][0]["frames"] == (0, 1, 2)
        assert document["sentence"] == "Failed: none of the 3 frames could be registered."
