"""A camera that goes around a box on a bare floor, and a box that moves before a camera at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from boxes import boxes

import nacre

Array = npt.NDArray[Any]

CAMERA = nacre.Camera(320, 240, 280, 280, 159.5, 119.5)
FLOOR = ((-7, 0, -7), (7, 0.1, 7))
BOX = ((-0.6, -0.9, -0.25), (0.6, 0, 0.25))
"""Each of its sides, with the floor, leaves the camera a way along it."""
RADIUS, HEIGHT = 2.4, 0.95


def looking_at_the_box(angle: float) -> Array:
    """Return the pose of a camera (y down) that has gone around the box by an angle [deg]."""
    turn = np.radians(angle)
    place = np.array([RADIUS * np.sin(turn), -HEIGHT, -RADIUS * np.cos(turn)])
    ahead = np.array([0.0, -0.45, 0.0]) - place
    ahead /= np.linalg.norm(ahead)
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    pose[:3, 3] = place
    return pose


def run(scenes: list[nacre.Mesh], poses: list[Array]) -> nacre.Model:
    """Return what a model makes of what a Kinect sees."""
    model = nacre.Model(CAMERA)
    for seed, (scene, pose) in enumerate(zip(scenes, poses, strict=True)):
        model.add_frame(scene.simulate_depth(CAMERA, pose, noise="kinect", seed=seed))
    return model


@pytest.mark.parametrize("step", [3, 10, 16])
def test_steps_around_a_box_are_found_that_only_its_ends_tell(step: int) -> None:
    poses = [looking_at_the_box(angle) for angle in range(0, 9 * step, step)]
    model = run([boxes(FLOOR, BOX)] * len(poses), poses)
    assert {report.status for report in model.frames} == {"TRACKED"}
    for report, pose in zip(model.frames, poses, strict=True):
        error = np.linalg.inv(np.linalg.inv(poses[0]) @ pose) @ report.world_from_camera
        assert np.linalg.norm(error[:3, 3]) < 0.02


def before_a_wall(place: float) -> nacre.Mesh:
    """Return a box on a floor, so far to the right, before a wall, and a small thing that stands askew."""
    still = boxes(((-7, 0.5, -1), (7, 0.6, 5)), ((-7, -1, 2.55), (7, 0.6, 2.65)))
    box = boxes(((place - 0.5, -0.3, 2.0), (place + 0.5, 0.5, 2.4)))
    thing = boxes(((-0.075, 0.3, -0.15), (0.075, 0.5, 0.15)))
    turn = np.array([[np.cos(0.3), 0, np.sin(0.3)], [0, 1, 0], [-np.sin(0.3), 0, np.cos(0.3)]])
    vertices = [still.vertices, box.vertices, thing.vertices @ turn.T + [0.9, 0, 2]]
    first = np.cumsum([0, *(len(part) for part in vertices)])
    triangles = [mesh.triangles + i for mesh, i in zip((still, box, thing), first, strict=False)]
    return nacre.Mesh(np.concatenate(vertices), np.concatenate(triangles))


def test_what_a_thing_that_stays_contradicts_is_no_motion_of_the_camera() -> None:
    places = [-0.4] * 6 + [-0.3, -0.2, -0.1]
    model = run([before_a_wall(place) for place in places], [np.eye(4)] * len(places))
    assert {report.status for report in model.frames[:6]} == {"TRACKED"}
    for report in model.frames:
        np.testing.assert_allclose(report.world_from_camera[:3, 3], 0, atol=0.02)
