"""What frames that cannot be right do to state and model: reported, never fused."""

from __future__ import annotations

import functools
import hashlib
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre

Array = npt.NDArray[Any]

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
CAMERA = nacre.Camera(160, 120, 190, 190, 79.5, 59.5)
SIGMA = 0.0005  # of the depth [m]
STEP = 3  # degrees from view to view
GROWN = 12  # views that a model has before something goes wrong


@pytest.fixture(autouse=True, scope="module")
def _importable() -> Iterator[None]:
    sys.path.insert(0, str(BENCHMARKS))
    yield
    sys.path.remove(str(BENCHMARKS))


@functools.cache
def thing() -> nacre.Mesh:
    return nacre.built_in_object()


@functools.cache
def pose(degrees: float) -> Array:
    return nacre.turntable_poses(thing(), 2, np.radians(degrees), camera=CAMERA, distance=0.3, elevation=0.3)[
        1
    ]


@functools.cache
def view(index: int, seed: int = 0) -> Array:
    return thing().simulate_depth(
        CAMERA, pose(STEP * index), noise=SIGMA, edge_mixing=1.0, seed=1000 * seed + index
    )


def is_right(report: nacre.FrameReport, index: int) -> bool:
    """Say whether a pose is within 2 mm and half a degree."""
    off = np.linalg.inv(np.linalg.inv(pose(0)) @ pose(STEP * index)) @ report.world_from_camera
    turn = np.degrees(np.arccos(min(1.0, (np.trace(off[:3, :3]) - 1) / 2)))
    return bool(np.linalg.norm(off[:3, 3]) < 0.002 and turn < 0.5)


def fingerprint(model: nacre.Model) -> str:
    digest = hashlib.sha256()
    for values in (model.points, model.normals, model.confidence, model.last_seen, *model.in_camera()):
        digest.update(values.tobytes())
    return digest.hexdigest()


def grown(count: int = GROWN) -> nacre.Model:
    model = nacre.Model(CAMERA)
    for index in range(count):
        assert model.add_frame(view(index)).status == "TRACKED"
    return model


def goes_on(model: nacre.Model, index: int = GROWN, first: str = "RELOCALISED") -> None:
    """Check that tracking goes on from a view, and rightly."""
    for i, expected in enumerate((first, "TRACKED", "TRACKED")):
        report = model.add_frame(view(index + i))
        assert report.status == expected
        assert is_right(report, index + i)


def random(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def hand() -> Array:
    return (0.07 + random().normal(0, 0.001, (120, 160))).astype(np.float32)


def other_scene() -> Array:
    """Return a heap of boxes."""
    import failures

    mesh = failures.boxes(random(3))
    return failures.view(mesh, failures.look(mesh, 1.0), 0)


SHAPE = (CAMERA.height, CAMERA.width)
WRONG: dict[str, Callable[[], Array]] = {
    "NaN": lambda: np.full(SHAPE, np.nan, np.float32),
    "zeros": lambda: np.zeros(SHAPE),
    "a hand on the lens": hand,
    "noise": lambda: random().uniform(0.1, 1, SHAPE),
    "blocks": lambda: np.kron(random().uniform(0.2, 0.4, (12, 16)), np.ones((10, 10))),
    "very noisy": lambda: view(GROWN) + random().normal(0, 0.02, SHAPE),
    "upside down": lambda: view(GROWN)[::-1],
    "another scene": other_scene,
    "twice as far": lambda: 2 * view(GROWN),
    "half as far": lambda: 0.5 * view(GROWN),
    "ten times as far": lambda: 10 * view(GROWN),
    "a fifth farther": lambda: 1.2 * view(GROWN),
    "a tenth farther": lambda: 1.1 * view(GROWN),
    "mirrored": lambda: view(GROWN)[:, ::-1],
}


def test_a_camera_that_turns_on_while_images_show_nothing_is_found_where_that_leads() -> None:
    step, missing = 5, range(6, 11)  # 15 degrees a view: only a fifth of the seventh is known
    model = nacre.Model(CAMERA)
    for index in range(13):
        report = model.add_frame(np.zeros(SHAPE) if index in missing else view(step * index))
        if index in missing:
            assert report.status == "LOST"
        else:
            assert report.status == ("RELOCALISED" if index == missing.stop else "TRACKED")
            assert is_right(report, step * index)


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_frame_is_lost_and_changes_no_byte(case: str) -> None:
    model = grown()
    before = fingerprint(model)
    for _ in range(3):
        report = model.add_frame(WRONG[case]())
        assert report.status == "LOST"
        assert report.reason
        assert fingerprint(model) == before
    goes_on(model)


def test_of_a_camera_that_is_lost_a_few_points_say_whether_it_still_is() -> None:
    model = grown()
    first, second = (model.add_frame(WRONG["another scene"]()) for _ in range(2))
    assert [first.status, second.status] == ["LOST", "LOST"]
    assert first.num_inliers / first.overlap > 601
    assert second.num_inliers / second.overlap == pytest.approx(600)


@pytest.mark.parametrize("factor", [1000, 0.001, 0.1, 200])
def test_millimetres_for_metres_are_refused(factor: float) -> None:
    model = grown()
    before, noise = fingerprint(model), model.noise
    with pytest.raises(ValueError, match="check depth_scale"):
        model.add_frame(factor * view(GROWN))
    assert fingerprint(model) == before
    assert model.noise == noise
    assert len(model.frames) == GROWN
    goes_on(model, first="TRACKED")


@pytest.mark.parametrize("factor", [0.9, 0.95, 0.97, 1.03, 1.05])
def test_a_scale_that_is_a_little_wrong_is_told(factor: float) -> None:
    """A larger object is not the same object farther away: its parts are farther from each other."""
    model = grown()
    before = fingerprint(model)
    report = model.add_frame(np.float32(factor) * view(GROWN))
    assert report.status == "LOST"
    told = re.search(r"the frame is ([0-9.]+) times as large", report.reason)
    assert told, report.reason
    assert float(told[1]) == pytest.approx(factor, abs=0.2 * abs(factor - 1))
    assert fingerprint(model) == before
    goes_on(model)


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_a_scale_that_is_wrong_by_a_fiftieth_is_not_recognised(factor: float) -> None:
    """A limit: real depth is off by as much."""
    report = grown().add_frame(np.float32(factor) * view(GROWN))
    assert report.status == "TRACKED"
    assert not is_right(report, GROWN)


def test_a_frozen_camera_neither_drifts_nor_adds() -> None:
    model = grown()
    model.add_frame(view(GROWN))
    points = len(model)
    first = model.frames[-1].world_from_camera[:3, 3]
    for _ in range(60):
        report = model.add_frame(view(GROWN))
        assert report.status == "TRACKED"
        assert np.linalg.norm(report.world_from_camera[:3, 3] - first) < 0.0003
        assert is_right(report, GROWN)
    assert len(model) < 1.02 * points


@pytest.mark.parametrize(("cover", "count"), [("zeros", 50), ("a hand on the lens", 12)])
def test_a_camera_covered_for_many_frames(cover: str, count: int) -> None:
    model = grown()
    before = fingerprint(model)
    covered = WRONG[cover]()
    assert {model.add_frame(covered).status for _ in range(count)} == {"LOST"}
    assert fingerprint(model) == before
    goes_on(model, GROWN + 2)


def test_frames_out_of_order() -> None:
    model = grown(1)
    for index in random(1).permutation(GROWN):
        report = model.add_frame(view(int(index)))
        assert report.status in {"TRACKED", "RELOCALISED"}
        assert is_right(report, int(index))


def test_a_camera_that_jumps_is_lost_within_three_frames() -> None:
    model = grown()
    before = fingerprint(model)
    statuses = [model.add_frame(view(60 + i)).status for i in range(3)]  # from behind
    assert statuses[-1] == "LOST"
    assert fingerprint(model) == before
    goes_on(model)


def test_one_garbage_frame_among_many() -> None:
    import failures

    told = failures.garbage(24, 0, every=24)
    assert told["garbage"] == {"LOST": 1}
    assert told["tracked"] == 23
    assert told["largest_shift_mm"] < told["sigma_mm"]
    assert told["outliers_with"] < told["outliers_without"] + 0.001


@pytest.mark.parametrize("fusion_method", ["fuse", "wlop", "wlop+"])
@pytest.mark.parametrize("value", [1e-30, 3e38])
def test_absurd_depths_leave_no_points_without_a_normal(fusion_method: str, value: float) -> None:
    depth = view(0).copy()
    depth[50:60, 70:80] = value
    model = nacre.Model(CAMERA, fusion_method=fusion_method)
    assert model.add_frame(depth).status == "TRACKED"
    assert np.allclose(np.linalg.norm(model.normals, axis=1), 1, atol=1e-3)
    assert np.isfinite(model.points).all()


@pytest.mark.parametrize("far", [1e14, 1e29, 1e31, 3e38])
@pytest.mark.parametrize(
    "camera", [CAMERA, nacre.Camera.orthographic(160, 120, 0.01)], ids=["pinhole", "orthographic"]
)
def test_a_model_with_absurdly_far_points_can_be_loaded(
    camera: nacre.Camera, far: float, tmp_path: Path
) -> None:
    depth = np.ones((camera.height, camera.width), np.float32)
    depth[: camera.height // 3] = far
    model = nacre.Model(camera)
    assert model.add_frame(depth).status == "TRACKED"
    assert np.abs(model.points).max() < 1e18
    model.save(tmp_path / "model")
    assert nacre.Model.load(tmp_path / "model").points.tobytes() == model.points.tobytes()


def test_noise_that_overflows_is_not_measured() -> None:
    depth = np.ones(SHAPE)
    depth.ravel()[random().choice(depth.size, 12000, replace=False)] = 1e-30
    noise = nacre.estimate_noise(depth, CAMERA)
    assert np.isfinite([noise.constant, noise.quadratic, noise.shared]).all()
    assert noise.sigma(1.0) > 0


@pytest.mark.parametrize("sigma", [1e-30, 1e-12, 1e9, 1e300])
def test_an_absurd_reference_leaves_unit_normals(sigma: float) -> None:
    model = nacre.Model(CAMERA, fusion={"reference_sigma": sigma})
    model.add_frame(view(0))
    model.add_frame(view(1))
    assert len(model) > 100
    assert np.allclose(np.linalg.norm(model.normals, axis=1), 1, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, pytest.param(50, marks=pytest.mark.weekly)])
def test_the_measured_experiments(count: int) -> None:
    import failures

    assert failures.recovery(4, 1)["right"] == 4
    assert "wrong" not in failures.recovery(count, 1)
    assert "fused wrongly" not in failures.kidnap(count, 1)


def test_noise_that_residuals_do_not_show_joins_no_bumps() -> None:
    import failures

    views = failures.different_scenes(50, np.random.default_rng(3))
    for first, second in [(44, 36), (38, 15), (20, 36)]:  # reliefs, and round shapes as large as their bumps
        model = nacre.Model(failures.CAMERA)
        model.add_frame(views[first])
        assert model.add_frame(views[second]).status == "LOST"


@pytest.mark.slow
def test_smooth_shapes_that_have_nothing_in_common_are_never_tracked() -> None:
    import failures

    assert failures.unrelated(12, 3)["false_success"] == 0


@pytest.mark.parametrize(
    ("seed", "trials"), [(0, 15), (1, 15), pytest.param(2, 2000, marks=pytest.mark.weekly)]
)
def test_random_frames(seed: int, trials: int) -> None:
    """The script that sent 100 000, for a moment; each frame has a status or is refused."""
    import random_frames

    told: Counter[str] = Counter()
    for trial in range(trials):
        random_frames.run_model(seed, trial, 40, 8, told)
    assert sum(told[status] for status in random_frames.STATUSES) + told["refused"] == told["frames"]


@pytest.mark.parametrize("trial", [3509, 7916])
def test_random_frames_that_once_broke_a_promise(trial: int) -> None:
    """Noise that was not a number, and points that were not: values that overflow where they are squared."""
    import random_frames

    random_frames.run_model(0, trial, 20, 12, Counter())


def test_a_frame_is_kept_in_a_few_bytes(tmp_path: Path) -> None:
    model = grown(2)
    sizes = []
    for _ in range(2):
        for _ in range(40):
            model.add_frame(WRONG["zeros"]())
        model.save(tmp_path / "model")
        sizes.append((tmp_path / "model").stat().st_size)
    assert (sizes[1] - sizes[0]) / 40 < 300
    assert len(model.frames) == 82
    assert model.frames[-1].reason
