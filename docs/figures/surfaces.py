"""Pictures of triangles and of the simulated camera."""

from __future__ import annotations

import draw
import numpy as np
from PIL import Image
from scenes import Turntable

import nacre
from nacre.meshing import mesh_points

NOISE = 0.0005  # [m]
FRONT, REVERSE = np.array([242, 236, 226]), np.array([184, 133, 97])


def triangles_panel(mesh: nacre.Mesh, view: draw.View):
    """Draw a mesh by casting a ray for each quarter of a pixel; reverse sides are brown."""
    width, height = view.size
    right, down, forward = view.view_from_model
    u, v = (np.arange(2 * n) / 2 - n / 2 + 0.25 for n in (width, height))
    start = view.center - 10 * forward
    origins = (start + view.metres_per_pixel * (u[None, :, None] * right + v[:, None, None] * down)).reshape(
        -1, 3
    )
    hit = mesh.cast(origins, np.tile(forward, (len(origins), 1))).triangles
    corners = np.asarray(mesh.vertices, float)[mesh.triangles[np.maximum(hit, 0)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = -normals @ forward / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
    base = np.where(facing[:, None] > 0, FRONT, REVERSE)
    shaded = np.where(hit[:, None] >= 0, base * (0.25 + 0.75 * np.abs(facing[:, None])), 255.0)
    large = Image.fromarray(shaded.reshape(2 * height, 2 * width, 3).astype(np.uint8))
    return np.asarray(large.resize((width, height), Image.Resampling.BOX))


def triangles(table: Turntable, size):
    """Draw a model's points, and the triangles over them."""
    model = nacre.Model(table.camera)
    for k in range(len(table.poses)):
        model.add_frame(table.view(k, NOISE, 1.0), guess=table.truth(k), keep_guess=True)
    view = draw.View.fit(model.points, (-0.6, -0.4, -1), size=size)
    grey = np.full((len(model.points), 3), 130, np.uint8)
    dots = draw.points_panel(model.points, model.normals, grey, view=view, size=size, spacing=0.0005)
    mesh = mesh_points(model.points, model.normals)
    return draw.sheet(
        [
            (f"{len(model.points)} points", dots),
            (f"{len(mesh.triangles)} triangles", triangles_panel(mesh, view)),
        ]
    )


def simulated(table: Turntable, size):
    """Draw a part of an exact depth image, with edges mixed, and with noise and quantisation, too."""
    scale = 4 if size[0] < 200 else 1
    camera = nacre.Camera(640 // scale, 480 // scale, 525 / scale, 525 / scale, 319.5 / scale, 239.5 / scale)
    pose = nacre.turntable_poses(table.mesh, 1, camera=camera)[0]
    exact = table.mesh.simulate_depth(camera, pose)
    mixed = table.mesh.simulate_depth(camera, pose, edge_mixing=2.0)
    rough = table.mesh.simulate_depth(
        camera, pose, edge_mixing=2.0, noise="kinect", quantization=0.002, dropout=0.02
    )
    v, u = np.nonzero(np.isfinite(exact))
    crop = (
        slice(int(v.min()) - 8 // scale, int((v.min() + v.max()) / 2)),
        slice(int((u.min() + u.max()) / 2), int(u.max()) + 8 // scale),
    )
    low, high = np.nanpercentile(exact[crop], (1, 99))
    panels = [("exact", exact), ("edges mixed", mixed), ("noise, steps, dropout, too", rough)]
    return draw.sheet(
        [
            (caption, draw.image_panel(draw.by_value(-image, -high - 0.01, -low), size, crop))
            for caption, image in panels
        ]
    )


FIGURES = {"triangles": triangles, "simulated": simulated}
