"""What leaves memory: the model is the same to the bit, and what was saved outlives a broken disk."""

import hashlib
import re
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

HALF_LENGTH, HALF_WIDTH, HALF_HEIGHT, RADIUS = 4.0, 0.06, 1.3, 2.5  # [m]
CAMERA = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
LAP, FRAMES, DRIFT = 120, 140, 0.03
FEW = 60_000  # of the 90 000 points of the model
SAVED = 110  # frames before it was saved, with loops to come


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


@dataclass
class Run:
    """A model whose points left memory, and what was saved of it on the way."""

    model: nacre.Model
    folder: Path
    saved: Path
    saved_folder: Path
    most: int  # points in memory, but where a loop brought layers together
    num_files: int


@pytest.fixture(scope="module")
def run(way: list[dict[str, Any]], tmp_path_factory: pytest.TempPathFactory) -> Run:
    place = tmp_path_factory.mktemp("run")
    folder, saved, saved_folder = place / "points", place / "model", place / "as-saved"
    model = nacre.Model(CAMERA, max_points=FEW, points_folder=folder)
    most = num_files = 0
    for k, frame in enumerate(way):
        if k == SAVED:
            model.save(saved)
            shutil.copytree(folder, saved_folder)
        if model.add_frame(**frame).loop_frame is None:
            most = max(most, len(model._core.cloud))
        num_files = max(num_files, len(list(folder.glob("*"))))
    return Run(model, folder, saved, saved_folder, most, num_files)


def test_a_model_whose_points_leave_memory_is_the_same_to_the_bit(whole: nacre.Model, run: Run) -> None:
    assert len(whole) > 1.3 * FEW
    assert run.most < 1.2 * FEW  # a frame adds some before others leave
    assert run.num_files > 5
    assert any(report.loop_frame is not None for report in run.model.frames)  # files had been written by then
    assert bits(run.model) == bits(whole)
    assert run.model.spacing == whole.spacing
    assert len(run.model.cloud()) == len(whole.cloud())
    run.model.recall_points()
    assert len(run.model._core.cloud) == len(run.model) == len(whole)
    assert bits(run.model) == bits(whole)


def test_a_saved_model_goes_on_from_its_files_wherever_they_are(
    way: list[dict[str, Any]], whole: nacre.Model, run: Run
) -> None:
    with pytest.raises(ValueError, match="points_folder must be the folder of the points that left"):
        nacre.Model.load(run.saved)
    for folder in (run.saved_folder, run.folder):  # where the first model went on meanwhile
        other = nacre.Model.load(run.saved, points_folder=folder)
        assert len(other) > len(other._core.cloud)
        assert bits(grown(other, way[SAVED:])) == bits(whole)


def test_files_go_that_nothing_saved_needs(
    way: list[dict[str, Any]], whole: nacre.Model, run: Run, tmp_path: Path
) -> None:
    folder = shutil.copytree(run.saved_folder, tmp_path / "points")
    before = set(folder.iterdir())
    model = grown(nacre.Model.load(run.saved, points_folder=folder), way[SAVED:])
    assert set(folder.iterdir()) >= before
    model.recall_points()
    model.save(tmp_path / "once")
    after = set(folder.iterdir())
    assert after >= before
    model.save(tmp_path / "twice")
    gone = after - set(folder.iterdir())
    assert gone
    assert gone < before  # points have come back: what key frames saw stays
    again = nacre.Model.load(tmp_path / "twice", points_folder=folder)
    assert bits(again) == bits(whole)


def test_points_that_cannot_be_written_stay(
    way: list[dict[str, Any]], whole: nacre.Model, tmp_path: Path
) -> None:
    folder = tmp_path / "points"
    folder.write_text("a file, where the folder should be")
    model = nacre.Model(CAMERA, max_points=FEW, points_folder=folder)
    with pytest.raises(OSError, match="points"):
        grown(model, way)
    done = len(model.frames)
    assert 0 < done < len(way)
    assert len(model) > FEW
    folder.unlink()
    assert bits(grown(model, way[done:])) == bits(whole)


@pytest.mark.parametrize("is_missing", [False, True])
def test_a_file_that_is_damaged_or_missing_is_named_and_what_was_saved_goes_on(
    is_missing: bool, way: list[dict[str, Any]], run: Run, tmp_path: Path
) -> None:
    folder = shutil.copytree(run.saved_folder, tmp_path / "points")
    model = nacre.Model.load(run.saved, points_folder=folder)

    def error_of(frame: dict[str, Any]) -> OSError | None:
        try:
            model.add_frame(**frame)
        except OSError as error:
            return error
        return None

    def needs_files(frame: dict[str, Any]) -> bool:
        """Return whether a frame needs a file, while all are damaged or missing."""
        files = {path: path.read_bytes() for path in folder.iterdir()}
        for path, data in files.items():
            path.unlink()
            if not is_missing:
                path.write_bytes(data[:-1])
        error = error_of(frame)
        for path, data in files.items():
            path.write_bytes(data)
        if error is not None:
            assert "what left the model's memory cannot be read" in str(error)
            assert Path(str(error.filename)) in files
        return error is not None

    def is_torn(frame: dict[str, Any]) -> bool:
        """Return whether it had changed the model by then: else it goes on as if nothing had been."""
        error = error_of(frame)
        if error is not None:
            assert "load what was saved" in str(error)
        return error is not None

    assert any(needs_files(frame) and is_torn(frame) for frame in way[SAVED:])
    with pytest.raises(OSError, match="load what was saved"):
        model.save(tmp_path / "model")


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
