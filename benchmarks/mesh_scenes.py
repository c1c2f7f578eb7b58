"""What meshes are made from and measured against: painted objects of known shape, and real recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cases
import numpy as np
import numpy.typing as npt

import nacre
from nacre import evaluation
from nacre.io.cloud import Cloud

Array = npt.NDArray[Any]
Bytes = npt.NDArray[np.uint8]

SAMPLES = 50_000
STEPS = {"teddy": 4, "icl": 6, "d435": 3, "rpy": 2}
"""Between the frames of long recordings that are taken: larger ones are not tracked."""
HELD_OUT = 8
"""Of the frames of a real recording each eighth is kept from the model."""
NEAR = 0.02
"""Of its depth: what was measured at a held-out pixel belongs to the mesh's surface."""


@dataclass
class Laid:
    """A mesh, colours of its vertices or none."""

    vertices: Array
    triangles: npt.NDArray[np.int32]
    colors: Array | None = None

    def colors_at(self, places: nacre.ClosestPoints) -> Array:
        """Blend the colours of the corners around points of the mesh."""
        assert self.colors is not None
        rows = self.triangles[places.triangles]
        a, b, c = (self.vertices[rows[:, i]] for i in range(3))
        normal = np.cross(b - a, c - a)
        whole = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-30)
        of_b = np.einsum("ij,ij->i", np.cross(places.points - a, c - a), normal) / whole
        of_c = np.einsum("ij,ij->i", np.cross(b - a, places.points - a), normal) / whole
        weights = np.clip(np.stack([1 - of_b - of_c, of_b, of_c], axis=1), 0, 1)
        blended: Array = np.einsum("ij,ijk->ik", weights, self.colors[rows]) / weights.sum(axis=1)[:, None]
        return blended


@dataclass(frozen=True)
class Figures:
    """
    How a mesh fits the truth.

    Errors [mm], NaN where the mesh does not reach what was measured; parts of 1; grey values.
    """

    errors: Array
    complete: float
    made_up: float
    color: float | None


class Scene:
    """What a method may use: a coloured cloud, and the images with their poses in its frame."""

    more_than = 1.0
    """Images that have to have seen a voxel."""

    def __init__(self, case: cases.Case, **options: Any) -> None:
        _, model = cases.run(case, num_threads=0, **options)
        self.camera: nacre.Camera = case.camera
        self.cloud: Cloud = model.cloud()
        neighbors = nacre.KdTree(self.cloud.points).query(self.cloud.points, 7)[0][:, 1:]
        self.spacing = float(np.median(neighbors.mean(axis=1)))
        self.finest, self.poses = model.spacing, model.poses
        self.depths, self.colors = case.depths, case.colors
        self.has_color = case.colors[0] is not None


class Painted(Scene):
    """An object of known shape with a painted surface, seen by a simulated camera."""

    def __init__(self, name: str) -> None:
        case = cases.make(name)
        assert case.mesh is not None
        self.truth = case.mesh
        self.paint = Paint(self.truth)
        case.colors = [self.paint.image(case.camera, pose, i) for i, pose in enumerate(case.truths)]
        super().__init__(case)
        self.spacing = self.finest
        known = [i for i, pose in enumerate(self.poses) if np.isfinite(pose).all()]
        truths = np.array([case.truths[i] for i in known])
        self.truth_from_model = cases.best_fit(self.poses[known], truths, 1.0, 180.0)[0]
        samples = evaluation.sample_surface(self.truth.vertices, self.truth.triangles, SAMPLES)
        self.seen = samples.points[evaluation.seen_samples(self.truth, samples, case.camera, truths)]

    def measure(self, laid: Laid) -> Figures:
        """Errors of the mesh within two spacings of a point of the model; what was seen within one."""
        spread = evaluation.sample_surface(laid.vertices, laid.triangles, SAMPLES).points
        near = nacre.KdTree(self.cloud.points).query(spread, 1)[0] <= 2 * self.spacing
        errors = 1000 * self.truth.distance(self._to_truth(spread[near]))
        moved = Laid(self._to_truth(laid.vertices), laid.triangles, laid.colors)
        found = nacre.Mesh(moved.vertices, moved.triangles).closest(self.seen)
        is_complete = found.distances <= self.spacing
        color = None
        if moved.colors is not None:
            shown = moved.colors_at(found)[is_complete]
            color = float(np.mean(np.abs(shown - self.paint.colors_at(self.seen[is_complete]))))
        return Figures(errors, float(is_complete.mean()), float(1 - near.mean()), color)

    def _to_truth(self, points: Array) -> Array:
        moved: Array = points @ self.truth_from_model[:3, :3].T + self.truth_from_model[:3, 3]
        return moved


class Paint:
    """Waves of colour over an object, a quarter to a sixteenth of its extent long."""

    def __init__(self, mesh: nacre.Mesh) -> None:
        rng = np.random.default_rng(0)
        self.mesh, extent = mesh, float(np.ptp(mesh.bounds, axis=0).max())
        directions = rng.normal(size=(3, 12, 3))
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        lengths = extent * np.geomspace(1 / 4, 1 / 16, 12)
        self.waves = 2 * np.pi * directions / lengths[:, None]
        self.phases = rng.uniform(0, 2 * np.pi, (3, 12))

    def colors_at(self, points: Array) -> Array:
        """Return the colours of points of the surface, 0 to 255."""
        waves = np.sin(np.einsum("ni,cwi->ncw", points, self.waves) + self.phases)
        colors: Array = np.clip(128 + 20 * waves.sum(axis=2), 0, 255)
        return colors

    def image(self, camera: nacre.Camera, pose: Array | None, seed: int) -> Bytes:
        """Return what a camera sees of it, with noise of 3 grey values, before something dark."""
        assert pose is not None
        points, (rows, columns) = backprojected(self.mesh.simulate_depth(camera, pose), camera)
        image = np.full((camera.height, camera.width, 3), 30.0)
        image[rows, columns] = self.colors_at(points @ pose[:3, :3].T + pose[:3, 3])
        image += np.random.default_rng(seed).normal(0, 3, image.shape)
        return np.clip(np.round(image), 0, 255).astype(np.uint8)


class Recorded(Scene):
    """A real recording, of which some frames are kept from the model to measure by."""

    def __init__(self, name: str) -> None:
        whole = cases.make(name, every=STEPS.get(name, 1))
        _, tracked = cases.run(whole, num_threads=0)
        kept = [i for i in range(len(whole.depths)) if i % HELD_OUT != HELD_OUT // 2]
        super().__init__(
            cases.Case(
                name,
                whole.camera,
                [whole.depths[i] for i in kept],
                [whole.colors[i] for i in kept],
                [whole.truths[i] for i in kept],
            )
        )
        self.held: list[tuple[Array, Bytes | None, Array]] = []
        for i in range(HELD_OUT // 2, len(whole.depths), HELD_OUT):
            # Its place beside the frame before it, by a model that saw both.
            beside = tracked.poses[i - 1], tracked.poses[i]
            pose = self.poses[kept.index(i - 1)] @ np.linalg.inv(beside[0]) @ beside[1]
            if np.isfinite(pose).all():
                self.held.append((whole.depths[i], whole.colors[i], pose))
        self.pixels_of_image = max(1, SAMPLES // len(self.held))

    def measure(self, laid: Laid) -> Figures:
        """
        Compare what held-out images measured with the mesh.

        Complete are pixels within 2 % of their depth of the mesh; errors are theirs. Made up is what of the
        mesh the camera would see before what it measured there.
        """
        mesh, rng = nacre.Mesh(laid.vertices, laid.triangles), np.random.default_rng(0)
        errors, tolerances, before, differences = [], [], [], []
        for depth, image, pose in self.held:
            points, (rows, columns) = backprojected(depth, self.camera)
            taken = rng.permutation(len(points))[: self.pixels_of_image]
            depths, pixels = points[taken, 2], (rows[taken], columns[taken])
            found = mesh.closest(points[taken] @ pose[:3, :3].T + pose[:3, 3])
            errors.append(found.distances)
            tolerances.append(NEAR * depths)
            drawn = mesh.simulate_depth(self.camera, pose)[pixels]
            before.append((drawn < (1 - 2 * NEAR) * depths)[np.isfinite(drawn)])
            near = found.distances <= NEAR * depths
            if laid.colors is not None and image is not None and near.any():
                shown, true = laid.colors_at(found)[near], image[pixels][near].astype(np.float64)
                gain = true.sum(axis=0) / np.maximum(shown.sum(axis=0), 1)
                differences.append(np.abs(gain * shown - true).mean(axis=1))
        distances = np.concatenate(errors)
        is_near = distances <= np.concatenate(tolerances)
        return Figures(
            np.where(is_near, 1000 * distances, np.nan),
            float(is_near.mean()),
            float(np.concatenate(before).mean()),
            float(np.concatenate(differences).mean()) if differences else None,
        )


def backprojected(depth: Array, camera: nacre.Camera) -> tuple[Array, tuple[Array, Array]]:
    """Return the points of a depth image in the camera's frame, and their rows and columns."""
    v, u = np.nonzero(np.nan_to_num(depth) > 0)
    z = depth[v, u].astype(np.float64)
    points = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=1)
    return points, (v, u)
