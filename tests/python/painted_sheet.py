"""A sheet whose paint is known, what cameras before it see, and what a texture has there."""

import numpy as np

import nacre
from nacre.meshing import TextureView

CAMERA = nacre.Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
SIDE = 45  # vertices


def sheet():
    """Return a wavy sheet of 0.4 m before the cameras, which look along z."""
    x, y = (a.ravel() for a in np.meshgrid(*[np.linspace(-0.2, 0.2, SIDE)] * 2))
    vertices = np.column_stack([x, y, 0.6 + 0.01 * np.sin(15 * x) * np.cos(12 * y)])
    corners = np.arange(SIDE**2).reshape(SIDE, SIDE)
    a, b, c, d = (
        part.ravel() for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:])
    )
    return vertices, np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])


VERTICES, TRIANGLES = sheet()


def paint(points):
    """Return the colours of the sheet, waves of 80 mm and more."""
    x, y = points[:, 0], points[:, 1]
    waves = [np.sin(75 * x), np.sin(60 * y + 1), np.sin(40 * (x + y))]
    return 128 + 60 * np.stack(waves, axis=1)


def pose_at(x, y=0.0):
    pose = np.eye(4)
    pose[:2, 3] = x, y
    return pose


def look(pose, exposure=1.0, paint=paint, mesh=(VERTICES, TRIANGLES)):
    """Return what a camera sees of a painted mesh, in an exposure that may vary over the (H, W) image."""
    v, u = np.indices((CAMERA.height, CAMERA.width))
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
    rays = rays.reshape(-1, 3) @ pose[:3, :3].T
    origins = np.broadcast_to(pose[:3, 3], rays.shape)
    hits = nacre.Mesh(*mesh).cast(origins, rays)
    color = np.where(np.isfinite(hits.distances)[:, None], paint(origins + hits.distances[:, None] * rays), 0)
    color = color.reshape(*u.shape, 3) * np.asarray(exposure)[..., None]
    depth = hits.distances.reshape(u.shape).astype(np.float32)
    return TextureView(np.clip(np.rint(color), 0, 255).astype(np.uint8), CAMERA, pose, depth)


VIEWS = [look(pose_at(x)) for x in (-0.15, 0.0, 0.15)]


def lookup(texture, uv):
    """Return colours between pixels, as graphics cards do."""
    height, width = texture.image.shape[:2]
    x, y = (uv * (width, height) - 0.5).T
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    color = np.zeros((len(uv), 3))
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - i - (x - left)) * np.abs(1 - j - (y - top))
            rows, columns = np.clip(top + j, 0, height - 1), np.clip(left + i, 0, width - 1)
            color += weight[:, None] * texture.image[rows, columns]
    return color
