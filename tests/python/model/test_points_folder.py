"""Points that leave memory: the model is the same to the bit, and a disk that fails loses nothing that was saved."""

import copy
import gc
import hashlib
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

HALF_LENGTH, HALF_WIDTH, HALF_HEIGHT, RADIUS = 4.0, 0.06, 1.3, 2.5  # [m]
CAMERA = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
LAP, FRAMES, DRIFT = 120, 140, 0.03
FEW = 60_000  # of the 90 000 points of the model


def box(low: Any, high: Any) -> tuple[Any, Any]:
    low, high = np.asarray(low, float), np.asarray(high, float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (high - low) + low
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners, np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])


def four_rooms() -> nacre.Mesh:
    """Return two walls that cross in a hall, with a door to each side of the middle, and furniture."""
    high = np.array([HALF_LENGTH, HALF_HEIGHT, HALF_LENGTH])
    parts = [box(-high, high)]
    for axes in ([0, 1, 2], [2, 1, 0]):
        for start, end in [(-HALF_LENGTH, -3.1), (-1.9, 1.9), (3.1, HALF_LENGTH)]:
            wall = np.array([[-HALF_WIDTH, -HALF_HEIGHT, start], [HALF_WIDTH, HALF_HEIGHT, end]])
            parts.append(box(*wall[:, axes]))
    random = np.random.default_rng(5)
    for angle in np.arange(0, 2 * np.pi, 0.06):
        way = np.array([np.cos(angle), 0, np.sin(angle)])
        place = way * 3.7 / abs(way).max() + [0, random.uniform(-1.0, 1.0), 0]
        half = random.uniform(0.05, 0.35, 3)
        parts.append(box(place - half, place + half))
    sizes = np.cumsum([0] + [len(corners) for corners, _ in parts])
    triangles = [t + n for (_, t), n in zip(parts, sizes[:-1], strict=True)]
    return nacre.Mesh(np.concatenate([corners for corners, _ in parts]), np.concatenate(triangles))


def frames() -> list[dict[str, Any]]:
    """Return a way once around through the rooms, and on; poses drift, and colours come in any exposure."""
    mesh, all_frames, first = four_rooms(), [], None
    for k in range(FRAMES):
        angle = 2 * np.pi * k / LAP
        heading = angle + np.pi / 5
        pose = np.eye(4)
        pose[:3, 0] = [-np.sin(heading), 0, np.cos(heading)]
        pose[:3, 0] *= -1
        pose[:3, 2] = [np.cos(heading), 0, np.sin(heading)]
        pose[:3, 1] = np.cross(pose[:3, 2], pose[:3, 0])
        pose[:3, 3] = [RADIUS * np.cos(angle), 0.08 * np.sin(3 * angle), RADIUS * np.sin(angle)]
        depth = mesh.simulate_depth(CAMERA, pose, noise="kinect", seed=k)
        light = np.array([40, 50, 30]) * (1 + 0.2 * np.sin(k / 20))
        color = np.clip(np.nan_to_num(depth)[..., None] * light, 0, 255).astype(np.uint8)
        first = pose if first is None else first
        moved = np.linalg.inv(first) @ pose
        moved[:3, 3] *= 1 + DRIFT * k / LAP
        guess = {"guess": first @ moved, "keep_guess": True, "movable": True}
        all_frames.append({"depth": depth, "color": color, **guess})
    return all_frames


@pytest.fixture(scope="module")
def way() -> list[dict[str, Any]]:
    return frames()


def grown(model: nacre.Model, way: Iterable[dict[str, Any]]) -> nacre.Model:
    for frame in way:
        model.add_frame(**frame)
    return model


def bits(model: nacre.Model) -> str:
    """Return a digest of the points, the poses, and what the reports count."""
    colors = model.colors
    assert colors is not None
    arrays = [model.points, model.normals, colors, model.confidence, model.last_seen, model.poses]
    counts = [(report.num_points, report.loop_frame) for report in model.frames]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays) + repr(counts).encode()).hexdigest()


@pytest.fixture(scope="module")
def whole(way: list[dict[str, Any]]) -> nacre.Model:
    return grown(nacre.Model(CAMERA), way)


def test_a_model_whose_points_leave_memory_is_the_same_to_the_bit(
    way: list[dict[str, Any]], whole: nacre.Model, tmp_path: Path
) -> None:
    folder = tmp_path / "points"
    model = nacre.Model(CAMERA, max_points=FEW, points_folder=folder)
    most, num_files = 0, 0
    for frame in way:
        if model.add_frame(**frame).loop_frame is None:  # there, layers are brought together
            most = max(most, len(model._core.cloud))
        num_files = max(num_files, len(list(folder.glob("*"))))
    assert len(whole) > 1.3 * FEW
    assert most < 1.2 * FEW  # a frame adds some before others leave
    assert num_files > 5
    assert sum(report.loop_frame is not None for report in model.frames) > 0  # points moved while they were away
    assert bits(model) == bits(whole)
    assert model.spacing == whole.spacing
    assert len(model.cloud()) == len(whole.cloud())
    model.recall_points()
    assert len(model._core.cloud) == len(model) == len(whole)
    assert bits(model) == bits(whole)
    assert list(folder.iterdir()) == []


def test_without_a_folder_the_spacing_is_widened(way: list[dict[str, Any]]) -> None:
    model = grown(nacre.Model(CAMERA, max_points=FEW), way)
    assert len(model) <= FEW
    assert model.spacing > 1.2 * model.frames[0].spacing


def test_a_saved_model_goes_on_from_its_files_wherever_they_are(
    way: list[dict[str, Any]], whole: nacre.Model, tmp_path: Path
) -> None:
    folder, moved = tmp_path / "points", tmp_path / "moved"
    model = nacre.Model(CAMERA, max_points=FEW, points_folder=folder)
    for k, frame in enumerate(way):
        if k in (100, 110):
            model.save(tmp_path / f"{k}")
        model.add_frame(**frame)
    del model  # what it wrote since then goes
    gc.collect()
    folder.rename(moved)
    with pytest.raises(ValueError, match="points_folder must be the folder of the points that left"):
        nacre.Model.load(tmp_path / "100")
    for k in (100, 110):
        other = grown(nacre.Model.load(tmp_path / f"{k}", points_folder=moved), copy.copy(way[k:]))
        assert bits(other) == bits(whole)


def test_points_that_cannot_be_written_stay(
    way: list[dict[str, Any]], whole: nacre.Model, tmp_path: Path
) -> None:
    folder = tmp_path / "points"
    folder.write_text("a file, where the folder should be")
    model = nacre.Model(CAMERA, max_points=FEW, points_folder=folder)
    done = 0
    with pytest.raises(OSError, match="points"):
        for frame in way:
            model.add_frame(**frame)
            done += 1
    assert len(model.frames) == done
    assert len(model) > FEW
    folder.unlink()
    assert bits(grown(model, way[done:])) == bits(whole)


@pytest.mark.parametrize("is_missing", [False, True])
def test_a_file_that_is_damaged_or_missing_is_named_and_what_was_saved_goes_on(
    is_missing: bool, way: list[dict[str, Any]], whole: nacre.Model, tmp_path: Path
) -> None:
    folder = tmp_path / "points"
    model = grown(nacre.Model(CAMERA, max_points=FEW, points_folder=folder), way[:110])
    model.save(tmp_path / "model")
    kept = {path: path.read_bytes() for path in folder.iterdir()}
    for path, data in kept.items():
        path.unlink()
        if not is_missing:
            path.write_bytes(data[:-1])
    with pytest.raises(OSError, match="points that left the model cannot be read") as caught:
        grown(model, way[110:])
    assert Path(str(caught.value.filename)) in kept
    with pytest.raises(OSError, match="load what was saved"):
        model.add_frame(**way[-1])
    with pytest.raises(OSError, match="load what was saved"):
        model.save(tmp_path / "model")
    for path, data in kept.items():
        path.write_bytes(data)
    other = nacre.Model.load(tmp_path / "model", points_folder=folder)
    assert bits(grown(other, way[110:])) == bits(whole)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"deform": True}, "points_folder must be empty for a model that deforms"),
        ({"loop_closure": False}, "points_folder must be used with loop_closure and fusion_method fuse"),
        ({"fusion_method": "wlop+"}, "points_folder must be used with loop_closure and fusion_method fuse"),
    ],
)
def test_what_needs_all_points_at_every_frame_refuses_a_folder(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        nacre.Model(CAMERA, points_folder=tmp_path, **changes)
