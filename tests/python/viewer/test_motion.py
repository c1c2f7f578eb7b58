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
from nacre.reconstruction import Reconstruction
from nacre.reconstruction.motion import Motion, read_motion
from nacre.viewer import LiveView, Snapshot, Timeline, in_frame_of, read_timeline
from nacre.viewer.page_data import PageData

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


def test_the_first_view_has_the_whole_way() -> None:
    def way(size: float) -> Any:
        cloud = plane()
        places = np.array([0.0, size]) / 1e-4
        points = np.rint((cloud.points - cloud.points.min(axis=0)) / 1e-4)[None] + places[:, None, None]
        normals = np.broadcast_to(np.array([128, 128], np.uint8), (2, len(cloud.points), 2))
        origin = cloud.points.min(axis=0).astype(np.float64)
        motion = Motion(np.array([0.0, 1.0]), points.astype(np.uint16), normals, origin, 1e-4)
        return json.loads(PageData([two_looks(replace(cloud, motion=motion))]).document)["view"]

    still, moving = way(0.0), way(0.2)
    np.testing.assert_allclose(np.subtract(moving["target"], still["target"]), [0.1, 0.1, 0.1], atol=0.02)
    assert moving["radius"] > still["radius"] + 0.05
