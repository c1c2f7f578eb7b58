"""What a depth camera looks at: an object that fills the frame, a room, and recordings of either."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from nacre import Camera, Mesh, NoiseModel
from suite.clouds import Array, bumpy_surface, rotation


def camera(width: int, height: int) -> Camera:
    """Return a pinhole camera that sees as much from left to right whatever its pixels."""
    focal = 525 * width / 640
    return Camera(width, height, fx=focal, fy=focal, cx=(width - 1) / 2, cy=(height - 1) / 2)


def matrix(camera: Camera) -> Array:
    """Return the intrinsics."""
    return np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])


CAMERA = camera(640, 480)
INTRINSICS = matrix(CAMERA)
PIXELS = np.stack([*np.meshgrid(np.arange(640.0), np.arange(480.0)), np.ones((480, 640))], axis=-1)
RAYS = PIXELS.reshape(-1, 3) @ np.linalg.inv(INTRINSICS).T
QUAD = np.array([[0, 1, 2], [0, 2, 3]])


@dataclass(frozen=True)
class Recording:
    """Depth images with their true poses: ``given`` ones, that make the model, and ``frames`` to be timed."""

    mesh: Mesh
    given: Array
    given_poses: Array
    frames: Array
    poses: Array


def sheet(corners: Array) -> tuple[Array, Array]:
    """Return a rectangle as a mesh."""
    return corners, QUAD


def box(low: Array, high: Array) -> list[tuple[Array, Array]]:
    """Return the six sides of a box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = np.asarray(low) + corners * (np.asarray(high) - low)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return [sheet(corners[side]) for side in sides]


def bumpy_mesh(
    radius: float, height: float, rings: int, frequencies: tuple[float, float]
) -> tuple[Array, Array]:
    """Return the bumpy surface as a mesh of rings around y."""
    polar, around = np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    level, reach = np.cos(polar)[:, None], np.sin(polar)[:, None]
    grid = np.broadcast_arrays(reach * np.cos(around), level, reach * np.sin(around))
    vertices, _ = bumpy_surface(np.stack(grid, axis=-1).reshape(-1, 3), radius, height, frequencies)
    row, column = np.mgrid[: rings - 1, : 2 * rings]
    here, right = row * 2 * rings + column, row * 2 * rings + (column + 1) % (2 * rings)
    below = 2 * rings
    halves = [[here, right, here + below], [right, right + below, here + below]]
    return vertices, np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])


def joined(parts: list[tuple[Array, Array]]) -> Mesh:
    """Return parts as one mesh."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return Mesh(vertices, np.concatenate([t + start for (_, t), start in zip(parts, starts, strict=True)]))


@cache
def object_mesh() -> Mesh:
    """Return a bumpy object of a metre."""
    return joined([bumpy_mesh(0.5, 0.06, 300, (10, 25))])


@cache
def room_mesh() -> Mesh:
    """Return a room of 5 x 2.6 x 4 m, y down, with furniture and seven bumpy things; the origin is inside."""
    parts = box(np.array([-2.5, -1.5, -2.0]), np.array([2.5, 1.1, 2.0]))
    rng = np.random.default_rng(4)
    for angle in np.arange(0.2, 2 * np.pi, 2 * np.pi / 14):
        distance, size = rng.uniform(1.3, 1.8), rng.uniform(0.15, 0.4, size=3)
        bottom = rng.choice([1.1, 0.3])  # on the floor, or on the wall
        place = np.array([distance * np.cos(angle), bottom - size[1], distance * np.sin(angle)])
        turn = rotation((0, 1, 0), rng.uniform(0, 90))
        parts += [((corners @ turn.T) + place, triangles) for corners, triangles in box(-size, size)]
    for angle in np.arange(0, 2 * np.pi, 2 * np.pi / 7):
        vertices, triangles = bumpy_mesh(0.25, 0.1, 80, (6, 14))
        place = np.array([1.4 * np.sin(angle), 0.6, 1.4 * np.cos(angle)])
        parts.append((vertices + place, triangles))
    return joined(parts)


def object_pose(angle: float) -> Array:
    """Return the pose at an angle around the object [deg], so near that it fills the frame."""
    nod = rotation((0, 1, 0), angle) @ rotation((1, 0, 0), 8 * np.sin(np.radians(3 * angle)))
    pose = np.eye(4)
    pose[:3, :3] = nod @ np.diag((1.0, -1, -1))
    pose[:3, 3] = nod @ (0, 0, 0.8)
    return pose


def room_pose(angle: float) -> Array:
    """Return the pose at an angle on a small circle in the middle of the room, looking out and down."""
    turn = rotation((0, 1, 0), angle)
    pose = np.eye(4)
    pose[:3, :3] = turn @ rotation((1, 0, 0), -20 + 5 * np.sin(np.radians(3 * angle)))
    pose[:3, 3] = turn @ (0, 0, 0.3)
    return pose


@cache
def recording(scene: str, num_given: int, num_frames: int, camera: Camera = CAMERA) -> Recording:
    """
    Return views 12 degrees apart, the middle one last, and frames of a camera that sways about it.

    It sways by up to 5 degrees, with steps of up to 1.5 degrees.
    """
    mesh, pose_at = {"object": (object_mesh, object_pose), "room": (room_mesh, room_pose)}[scene]
    given = np.array(sorted(12.0 * (np.arange(num_given) - num_given // 2), key=abs, reverse=True))
    swayed = 5 * np.sin(0.3 * np.arange(1, num_frames + 1))

    def views(angles: Array, seed: int) -> tuple[Array, Array]:
        poses = np.array([pose_at(angle) for angle in angles])
        noise = NoiseModel(0.0005) if scene == "object" else NoiseModel.kinect()
        depths = [
            mesh().simulate_depth(camera, pose, noise=noise, edge_mixing=1, seed=seed + i)
            for i, pose in enumerate(poses)
        ]
        return np.array(depths), poses

    return Recording(mesh(), *views(given, 1000), *views(swayed, 0))
