"""Runs that are compared stand in one world frame."""

from __future__ import annotations

import functools
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import evaluation
from nacre.report import ReportedFrame

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import plane, two_looks

viewer = pytest.importorskip("nacre.viewer")
IDENTITY = np.eye(4)
QUARTER = np.array([[0, 0, 1, 0.3], [0, 1, 0, -0.1], [-1, 0, 0, 0.5], [0, 0, 0, 1.0]])


built_in_object = functools.cache(nacre.built_in_object)


def run_of(seed: int, world_from_object: np.ndarray = IDENTITY) -> viewer.Timeline:
    """Return a run of one frame whose model is a sample of the built-in object, 3 mm between points."""
    mesh = built_in_object()
    samples = evaluation.sample_surface(mesh.vertices, mesh.triangles, 5000, seed=seed)
    rotation, shift = world_from_object[:3, :3], world_from_object[:3, 3]
    timeline = viewer.Timeline(f"run {seed}", None)
    timeline.add(ReportedFrame(0, "TRACKED", world_from_camera=world_from_object, overlap=0.5))
    points = (samples.points @ rotation.T + shift).astype(np.float32)
    timeline.set_snapshot(viewer.Snapshot(points, (samples.normals @ rotation.T).astype(np.float32), 0.003))
    return timeline


def test_a_run_in_another_frame_is_brought_onto_the_first() -> None:
    first, other = run_of(0), run_of(1, QUARTER)
    moved = viewer.in_frame_of(first, other)
    distances = built_in_object().distance(moved.snapshots[-1][1].points)
    assert np.median(distances) < 0.0005
    assert np.allclose(moved.frames[0].world_from_camera, np.eye(4), atol=0.002)
    assert moved.frames[0].figures["overlap"] == 0.5
    assert "90.0" in moved.placement
    assert "onto the first run" in moved.placement
    assert other.placement == ""
    assert np.array_equal(other.frames[0].world_from_camera, QUARTER)


def test_a_run_in_the_same_frame_stays() -> None:
    first, other = run_of(0), run_of(1)
    kept = viewer.in_frame_of(first, other)
    assert np.array_equal(kept.snapshots[-1][1].points, other.snapshots[-1][1].points)
    assert kept.placement == "in the first run's world frame"


def test_another_scene_is_not_moved_and_the_run_says_so() -> None:
    first, other = run_of(0), two_looks(plane(depth=3.0))
    kept = viewer.in_frame_of(first, other)
    assert np.array_equal(kept.snapshots[-1][1].points, other.snapshots[-1][1].points)
    assert kept.placement.startswith("not moved")


def test_a_run_without_a_model_is_left_to_the_page() -> None:
    empty = viewer.Timeline("empty", None)
    assert viewer.in_frame_of(run_of(0), empty) is empty
