"""What the pictures show: an object on a turntable, a furnished room, an object on a table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import nacre


@dataclass(frozen=True)
class Turntable:
    """Depth images of an object, taken by a camera that goes around it."""

    mesh: nacre.Mesh
    camera: nacre.Camera
    poses: np.ndarray

    @classmethod
    def around(cls, mesh: nacre.Mesh, num_views=12, step=30.0, small=False) -> Turntable:
        """Return views of 1 mm pixels (of 2 mm where small), as many degrees apart."""
        camera = nacre.default_camera(mesh)
        if small:
            half = camera.width // 2
            camera = nacre.Camera.orthographic(half, half, 2 * camera.pixel_size)
        return cls(mesh, camera, nacre.turntable_poses(mesh, num_views, math.radians(step)))

    def view(self, k: int, sigma=0.0, edge_mixing=0.0):
        """Return the depth image of a view."""
        return self.mesh.simulate_depth(
            self.camera, self.poses[k], noise=sigma, edge_mixing=edge_mixing, seed=k
        )

    def cloud(self, k: int, sigma=0.0):
        """Return points and normals of a cleaned view, in the camera's frame."""
        return points_and_normals(self.view(k, sigma, 1.0), self.camera)

    def truth(self, k: int):
        """Return the pose of view k in the frame of the first."""
        return np.linalg.inv(self.poses[0]) @ self.poses[k]

    def errors(self, points):
        """Return how far outside the object points of the first camera's frame are [m]."""
        closest = self.mesh.closest(moved(points, self.poses[0]))
        away = moved(points, self.poses[0]) - closest.points
        return np.einsum("ij,ij->i", away, closest.normals)


def points_and_normals(depth, camera):
    """Return the points of a depth image that have a normal, and these."""
    clean = nacre.preprocess_depth(depth, camera)
    normals = nacre.depth_normals(clean, camera)[np.isfinite(clean)]
    points = nacre.back_project(clean, camera)
    known = np.isfinite(normals).all(axis=1)
    return points[known], normals[known]


def moved(points, pose):
    """Return points after a motion."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def rotation(axis, angle):
    """Return a motion (4, 4) that turns about an axis through the origin, Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return pose


def box(center, size, turn=0.0):
    """Return vertices and triangles of a box, turned about y."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    return moved(corners, rotation((0, 1, 0), turn)) + center, np.array(triangles)


def joined(parts) -> nacre.Mesh:
    """Return one mesh of several (vertices, triangles)."""
    first = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    triangles = [t + n for (_, t), n in zip(parts, first[:-1], strict=True)]
    return nacre.Mesh(np.concatenate([vertices for vertices, _ in parts]), np.concatenate(triangles))


def furnished_room() -> nacre.Mesh:
    """Return a room of 4 m x 2.6 m x 4 m with boxes along its walls, y down."""
    random = np.random.default_rng(3)
    parts = [box(np.zeros(3), [4.0, 2.6, 4.0])]
    for i in range(90):
        angle = 2 * math.pi * (i + random.random()) / 90
        way = np.array([math.sin(angle), 0, math.cos(angle)])
        place = (1.9 / abs(way).max() - 0.4 * random.random()) * way + [0, random.uniform(-1.1, 1.1), 0]
        parts.append(box(place, random.uniform(0.1, [0.5, 0.7, 0.5]), random.uniform(0, math.pi)))
    return joined(parts)


def walk_around(k: int, num_frames: int):
    """Return the pose of a camera that looks outwards and turns once in so many frames."""
    angle = 2 * math.pi * k / num_frames
    pose = rotation((0, 1, 0), angle)
    pose[:3, 3] = [0.3 * math.sin(angle), 0.06 * math.sin(3 * angle), 0.3 * math.cos(angle)]
    return pose


def on_a_table(mesh: nacre.Mesh):
    """Return a scene of an object on a table before a wall, a camera that looks down at it, and its pose."""
    low, high = mesh.bounds
    middle = (low + high) / 2
    table = box([middle[0], low[1] - 0.01, middle[2]], [0.7, 0.02, 0.5])
    wall = box([middle[0], low[1] + 0.2, middle[2] - 0.4], [2.0, 1.4, 0.02])
    cup = box([middle[0] + 0.2, low[1] + 0.035, middle[2] - 0.08], [0.06, 0.07, 0.06], 0.4)
    scene = joined([(np.asarray(mesh.vertices, float), np.asarray(mesh.triangles)), table, wall, cup])
    pose = nacre.turntable_poses(mesh, 1, distance=0.45, elevation=math.radians(24))[0]
    return scene, pose
