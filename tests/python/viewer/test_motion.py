"""The time line shows what bends where it was at each frame."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.io.quantization import octahedral
from nacre.reconstruction import Reconstruction
from nacre.report import ReportedFrame
from nacre.run_data.motion import Motion, read_motion
from nacre.viewer import LiveView, Snapshot, Timeline, in_frame_of, read_timeline
from nacre.viewer.page_data import PageData
from nacre.viewer.views import first_seen, first_view

sys.path.insert(0, str(Path(__file__).parents[1]))
from bending_sheet import CAMERA, CURVATURES, sheet
from viewer_scenes import plane, two_looks

LOST = 3


def header_of(block: bytes) -> Any:
    """Return what the header of packed bytes says."""
    return json.loads(block[4 : 4 + int.from_bytes(block[:4], "little")])


def points_of(timeline: Timeline) -> Any:
    """Return the header of the points of the newest state on the page."""
    data = PageData([timeline])
    return header_of(data.read(data.names[-1]))


def test_the_folder_of_a_run_tells_where_the_points_were(bent: Path) -> None:
    ((_, cloud),) = read_timeline(bent).snapshots
    motion = read_motion(bent / "motion.npz")
    for place in range(7):
        shape = cloud.at(place)
        np.testing.assert_array_equal(shape.points, motion.at(place)[0])
        np.testing.assert_array_equal(shape.normals, motion.at(place)[1])
    np.testing.assert_array_equal(cloud.points, nacre.read_points(bent / "model.ply").points)
    assert cloud.rows(slice(None, None, 2), 1.0).at(6).points[5] == pytest.approx(motion.at(6)[0][10])


def test_the_page_has_every_shape(bent: Path) -> None:
    timeline, motion = read_timeline(bent), read_motion(bent / "motion.npz")
    header = points_of(timeline)
    assert header["motion"]["moments"] == [0, 1, 2, 2, 3, 4, 5]
    sizes = {column["name"]: (column["rows"], column["width"]) for column in header["columns"]}
    num_shapes, num_points, _ = motion.points.shape
    assert sizes["shapes"] == (num_shapes * num_points, 3)
    assert sizes["shapeNormals"] == (num_shapes * num_points, 2)
    assert not any(name.startswith("holes/") for name in PageData([timeline]).surface_names)


def test_the_page_of_what_is_rigid_has_none() -> None:
    header = points_of(two_looks(plane()))
    assert "motion" not in header
    assert {column["name"] for column in header["columns"]}.isdisjoint({"shapes", "shapeNormals"})


def test_two_runs_are_compared_in_their_canonical_shapes(bent: Path) -> None:
    first, other = read_timeline(bent), read_timeline(bent)
    data = PageData([first, in_frame_of(first, other)])
    for name in data.names[1:]:
        assert "motion" not in header_of(data.read(name))


def test_a_motion_of_another_model_is_left_out(bent: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(bent, tmp_path / "out")
    cloud = nacre.read_points(copy / "model.ply")
    nacre.write_points(copy / "model.ply", cloud.points[1:], normals=cloud.normals[1:])
    with pytest.warns(UserWarning, match="the motion is left out: .*points, the run 7 of"):
        ((_, shown),) = read_timeline(copy).snapshots
    assert shown.motion is None


def test_a_model_tells_how_it_moved() -> None:
    model = nacre.Model(CAMERA, deform=True)
    for curvature in CURVATURES[:3]:
        model.add_frame(sheet(curvature).simulate_depth(CAMERA, np.eye(4)))
        np.testing.assert_array_equal(Snapshot.of(model).points, model.points_at(len(model.frames) - 1))
    np.testing.assert_array_equal(Snapshot.of(model, 0).points, model.points_at(0))
    told = Timeline.of(model, "sheet")
    assert [frame.status for frame in told.frames] == ["TRACKED"] * 3
    ((place, cloud),) = told.snapshots
    assert place == 2
    assert cloud.motion is not None
    for frame in range(3):
        assert np.abs(cloud.at(frame).points - model.points_at(frame)).max() < 0.51 * cloud.motion.step
    np.testing.assert_array_equal(cloud.points, model.points)


def test_a_rigid_model_stands_still() -> None:
    model = nacre.Model(CAMERA)
    assert not Timeline.of(model).has_points
    model.add_frame(sheet(0.0).simulate_depth(CAMERA, np.eye(4)))
    ((_, cloud),) = Timeline.of(model).snapshots
    assert cloud.motion is None
    assert cloud.at(0) is cloud
    np.testing.assert_array_equal(cloud.points, model.points)


def test_while_it_grows_each_state_is_as_it_was(bent: Path) -> None:
    sequence = nacre.open_sequence(bent.parent / "recording")
    done = Reconstruction(sequence, nacre.Model(sequence.camera, deform=True))
    live = LiveView(done, "sheet", port=0)
    try:
        for place, record in enumerate(done.run()):
            live.add(record)
            live.show()
            shown = live.timeline.snapshots[-1][1].points
            np.testing.assert_array_equal(shown, done.model.points_at(2 if place == LOST else place))
    finally:
        live.viewer.close()


def moved(cloud: Snapshot, *shifts: float) -> Snapshot:
    """Return a cloud that is shifted at each frame, along each axis [m]."""
    step, origin = 1e-4, cloud.points.min(axis=0).astype(np.float64)
    shapes = cloud.points[None] - origin + np.array(shifts)[:, None, None]
    normals = np.broadcast_to(octahedral(cloud.normals), (len(shifts), len(cloud.points), 2))
    moments = np.arange(len(shifts), dtype=np.float64)
    motion = Motion(moments, np.rint(shapes / step).astype(np.uint16), normals, origin, step)
    return replace(cloud, motion=motion)


def test_the_first_view_has_the_whole_way() -> None:
    still, moving = (first_view(moved(plane(), 0, size), two_looks(plane()), 1) for size in (0.0, 0.2))
    np.testing.assert_allclose(moving.target - still.target, [0.1, 0.1, 0.1], atol=0.02)
    assert moving.radius > still.radius + 0.05


def test_points_appear_with_the_frame_that_had_them_in_view_where_they_were() -> None:
    timeline = Timeline("plane", CAMERA)
    for index in range(3):
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=np.eye(4)))
    assert set(first_seen(plane(), timeline, 2).tolist()) == {0}
    assert set(first_seen(moved(plane(), 5, 0, 5), timeline, 2).tolist()) == {1}
