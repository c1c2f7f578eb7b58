"""What a model lacks: a hole that was cut, and a rim that is not taken for one."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.meshing import triangulate
from nacre.report import ReportedFrame
from nacre.viewer import Snapshot, Timeline
from nacre.viewer.holes import Holes, find_holes
from nacre.viewer.page_data import PageData

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import CAMERA, SPACING, plane

RIM = 80  # edges around the plane
HOLE = 0.1  # m, its width


def with_hole(x: float = 0.0) -> Snapshot:
    """Return the plane without 9 x 9 points around its middle, or beside it."""
    cloud = plane()
    kept = (np.abs(cloud.points[:, :2] - (x, 0)) > 4.5 * SPACING).any(axis=1)
    return cloud.rows(np.flatnonzero(kept), SPACING)


def seen_by(camera: nacre.Camera | None, *xs: float) -> Timeline:
    """Return a run whose cameras look along z from some places."""
    timeline = Timeline("plane", camera)
    for index, x in enumerate(xs):
        pose = np.eye(4)
        pose[0, 3] = x
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose))
    return timeline


def holes_of(cloud: Snapshot, timeline: Timeline) -> Holes:
    triangles = triangulate(cloud.points, cloud.normals)
    return find_holes(cloud, triangles, timeline, len(timeline.frames) - 1)


def test_a_hole_is_outlined_where_it_is() -> None:
    found = holes_of(with_hole(0.02), seen_by(CAMERA, 0.0))
    assert found.sizes == pytest.approx([HOLE])
    ends = found.segments[found.is_hole == 1].reshape(-1, 2, 3)
    offsets = ends[..., :2] - (0.02, 0)
    np.testing.assert_allclose(np.abs(offsets).max(axis=2), HOLE / 2, atol=1e-6)
    np.testing.assert_allclose(ends[1:, 0], ends[:-1, 1], atol=1e-6)  # edge by edge, all around
    np.testing.assert_allclose(ends[0, 0], ends[-1, 1], atol=1e-6)
    assert (ends[..., 2] < 1).all()  # above the surface, which faces the camera
    assert (found.is_hole == 0).sum() == RIM


def test_what_the_images_cut_off_goes_on() -> None:
    narrow = nacre.Camera(100, 100, 505, 505, 49.5, 49.5)  # its image ends 1 mm within the plane's edge
    found = holes_of(with_hole(), seen_by(narrow, 0.0))
    assert found.is_hole.all()
    assert found.sizes == pytest.approx([HOLE])
    moved = holes_of(with_hole(), seen_by(narrow, 0.0, 0.05))  # now the right side is well in view
    ends = moved.segments[moved.is_hole == 0].reshape(-1, 2, 3)
    assert len(ends) > 10
    assert (ends[..., 0] > 0.0999).all()


@pytest.mark.parametrize("depth_range", [(0, 1.01), (0.99, np.inf)], ids=["farthest", "nearest"])
def test_what_the_limits_of_depth_cut_off_goes_on(depth_range: tuple[float, float]) -> None:
    """The plane is at 1 m from one camera, well within the limits of another."""
    timeline = seen_by(CAMERA, 0.0, 0.01)
    timeline.depth_range = depth_range
    assert len(holes_of(with_hole(), timeline).segments) == 0
    closer = timeline.frames[1].world_from_camera
    assert closer is not None
    closer[2, 3] = 0.1 if depth_range[0] == 0 else -0.1
    found = holes_of(with_hole(), timeline)
    assert found.sizes == pytest.approx([HOLE])
    assert (found.is_hole == 0).sum() == RIM


def test_a_hole_that_is_not_seen_whole_is_none() -> None:
    narrow = nacre.Camera(100, 100, 2000, 2000, 49.5, 49.5)  # sees 5 cm of the plane, all of it in the hole
    assert holes_of(with_hole(), seen_by(narrow, 0.0)).sizes == []


def test_without_cameras_every_border_counts() -> None:
    found = holes_of(with_hole(), Timeline("points", None))
    assert found.sizes == pytest.approx([HOLE])
    assert (found.is_hole == 0).sum() == RIM


def test_gaps_and_flakes_are_left_out() -> None:
    cloud = plane()
    flake = cloud.rows(np.flatnonzero(np.abs(cloud.points[:, :2]).max(axis=1) < 0.05), SPACING)
    assert len(holes_of(flake, seen_by(CAMERA, 0.0)).segments) == 0
    nothing = cloud.rows(slice(0, 0), SPACING)
    assert len(holes_of(nothing, seen_by(CAMERA, 0.0)).segments) == 0


def test_the_page_reads_them_by_the_name_of_the_state() -> None:
    timeline = seen_by(CAMERA, 0.0)
    timeline.set_snapshot(with_hole())
    data = PageData([timeline])
    (name,) = (name for name in data.surface_names if name.startswith("holes/"))
    assert b'"sizes": [0.1' in data.read(name)
    with pytest.raises(KeyError):
        data.read("holes/0/0/1")
