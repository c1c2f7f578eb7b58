"""A depth camera looking at a triangle mesh: images, poses to take them from, cameras to take them with."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.camera import Camera
from nacre.mesh import Mesh, SensorName
from nacre.noise import NoiseModel, NoiseName


@guided("of a Mesh it is mesh.simulate_depth(camera, world_from_camera)")
def simulate_depth(
    vertices: npt.ArrayLike,
    triangles: npt.ArrayLike,
    camera: Camera,
    world_from_camera: npt.ArrayLike,
    *,
    sensor: SensorName = "none",
    noise: float | NoiseName | NoiseModel = 0.0,
    edge_mixing: float = 0.0,
    background_depth: float | None = None,
    quantization: float = 0.0,
    dropout: float = 0.0,
    seed: int = 0,
    sensor_seed: int = 0,
    num_threads: int = 0,
) -> npt.NDArray[np.float32]:
    """
    Return the depth image of a triangle mesh that a camera sees.

    Without a sensor, noise and edge mixing each pixel is exact: the first intersection of its ray with the
    mesh, from either side. Several views of one mesh are faster with :meth:`nacre.Mesh.simulate_depth`, which
    keeps the search tree.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        [m].
    triangles : (T, 3) array_like of integers
        Vertex indices.
    camera : nacre.Camera
        Its depth kind is the image's. Rays start at depth 0: an orthographic camera sees nothing behind its
        plane.
    world_from_camera : (4, 4) array_like
        The camera's pose in the frame of the vertices; OpenCV axes (x right, y down, z forward).
    sensor : "none", "stereo", "structured_light", "time_of_flight" or "phone_lidar"
        A kind of depth camera, with errors that neighbouring pixels and successive images share, steps in
        disparity, holes, and pixels at edges that are wrong. Needs a pinhole camera, best with the sensor's
        own focal length, since many of its errors are in pixels. See the page on the simulated camera.
    noise : float, "kinect", "stereo", "tof" or nacre.NoiseModel
        Standard deviation of Gaussian noise along the depth value, independent from pixel to pixel [m];
        "kinect" is that of structured light, 1.2 mm + 1.9 mm (z - 0.4 m)^2 [1]_.
    edge_mixing : float or bool
        Pixels within this distance of a depth edge [pixels] see both sides of it: their depth is that of a
        finer image, blurred and sampled down, as the mean of rays weighted by a tent of this radius. Rays
        that hit nothing see the background. Pixels that see nothing but background stay NaN, pixels away from
        edges stay exact. True is 1: the blur is as wide as a pixel. 0 to 16.
    background_depth : float, optional
        What silhouettes mix with [m]. By default a tenth of the diagonal of the mesh's bounding box behind
        the farthest visible point.
    quantization : float
        Depth is rounded to multiples of this [m]; 0: not at all.
    dropout : float
        Part of the pixels that give no measurement, 0 to 1, at random.
    seed : int
        Of the image: another for each of a recording. The same seed gives the same bits for any number of
        threads.
    sensor_seed : int
        Of the errors that all images of one sensor share.
    num_threads : int
        0: all.

    Returns
    -------
    (H, W) float32
        [m]; NaN = nothing was seen. The steps come in the order sensor or edge mixing, noise, quantization,
        dropout; depths that they make 0 or negative become NaN.

    Raises
    ------
    TypeError, ValueError
        Name the argument, what was expected and what came.

    References
    ----------
    .. [1] C. V. Nguyen, S. Izadi, D. Lovell: Modeling Kinect sensor noise for improved 3D reconstruction and
       tracking. 3DIMPVT 2012.
    """
    return Mesh(vertices, triangles).simulate_depth(
        camera,
        world_from_camera,
        sensor=sensor,
        noise=noise,
        edge_mixing=edge_mixing,
        background_depth=background_depth,
        quantization=quantization,
        dropout=dropout,
        seed=seed,
        sensor_seed=sensor_seed,
        num_threads=num_threads,
    )


@guided()
def turntable_poses(
    mesh: Mesh | npt.ArrayLike,
    num_views: int = 12,
    step: float = math.radians(30),
    *,
    camera: Camera | None = None,
    distance: float | None = None,
    elevation: float = 0.0,
    axis: npt.ArrayLike = (0.0, 1.0, 0.0),
) -> npt.NDArray[np.float64]:
    """
    Return the poses of a camera that circles around an object and looks at the centre of its bounding box.

    Parameters
    ----------
    mesh : nacre.Mesh or (V, 3) array_like
        The object, or its vertices [m].
    num_views : int
        At least 1.
    step : float
        From view to view the camera turns by this angle about ``axis``, by the right-hand rule [rad].
    camera : nacre.Camera, optional
        Sets the default distance: a pinhole camera stands as near as it can with the whole object in view.
    distance : float, optional
        From the centre [m]. Without a pinhole ``camera`` 1.5 times the diagonal of the bounding box.
    elevation : float
        Angle of the camera above the plane through the centre across ``axis`` [rad], between -pi/2 and pi/2.
    axis : 3 numbers
        What points up in the images. For the default the first camera stands at +z and has +x to its right.

    Returns
    -------
    (num_views, 4, 4) float64
        ``world_from_camera``, OpenCV axes.
    """
    num_views = arrays.as_count("num_views", num_views, minimum=1)
    if camera is not None:
        arrays.as_camera("camera", camera)
    if not abs(arrays.as_number("step", step)) <= 2 * math.tau:
        raise ValueError(
            f"step must be radians, two turns at most, got {step!r}; math.radians(30) is 30 degrees"
        )
    if not abs(arrays.as_number("elevation", elevation)) < math.pi / 2:
        raise ValueError(f"elevation must lie between -pi/2 and pi/2, got {elevation!r}")
    lower, upper = _bounds(mesh)
    up = arrays.as_vector("axis", axis, 3)
    if not up.any():
        raise ValueError(f"axis must not be 0, got {axis!r}")
    up = up / np.abs(up).max()
    up = up / np.linalg.norm(up)
    if distance is None:
        distance = _viewing_distance(0.5 * float(np.linalg.norm(upper - lower)), camera)
    if not (math.isfinite(arrays.as_number("distance", distance)) and distance > 0):
        raise ValueError(f"distance must be a positive length in metres, got {distance!r}")

    # The side that the first camera stands on: the world axis after `axis`, made orthogonal to it.
    front = np.roll(np.eye(3)[np.argmax(np.abs(up))], 1)
    front = front - (front @ up) * up
    front /= np.linalg.norm(front)
    side = np.cross(up, front)
    poses = np.tile(np.eye(4), (num_views, 1, 1))
    for pose, angle in zip(poses, step * np.arange(num_views), strict=True):
        outward = math.cos(angle) * front + math.sin(angle) * side
        back = math.cos(elevation) * outward + math.sin(elevation) * up
        right = np.cross(up, outward)
        pose[:3, :3] = np.stack([right, np.cross(right, back), -back], axis=1)
        pose[:3, 3] = 0.5 * (lower + upper) + distance * back
    return poses


@guided()
def default_camera(
    mesh: Mesh | npt.ArrayLike, model: Literal["orthographic", "pinhole"] = "orthographic"
) -> Camera:
    """
    Return a camera that suits an object seen from :func:`turntable_poses`.

    Parameters
    ----------
    mesh : nacre.Mesh or (V, 3) array_like
        The object, or its vertices [m].
    model : "orthographic" or "pinhole"
        Orthographic: a square image with room for the object from every side, in which its largest extent is
        about 150 pixels long (the pixel size has one significant digit; 1 mm for an object of 0.15 m).
        Pinhole: the first Kinect's, 640 x 480 pixels with a focal length of 525.

    Returns
    -------
    nacre.Camera
    """
    lower, upper = _bounds(mesh)
    if model == "pinhole":
        return Camera(width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5)
    if model != "orthographic":
        raise ValueError(f"model must be 'orthographic' or 'pinhole', got {model!r}")
    extent = float((upper - lower).max())
    if extent == 0:
        raise ValueError("mesh must have an extent, got a single point")
    pixel_size = float(f"{extent / 150:.0e}")
    size = 32 * math.ceil(float(np.linalg.norm(upper - lower)) / pixel_size / 32)
    return Camera.orthographic(width=size, height=size, pixel_size=pixel_size)


def _bounds(mesh: Mesh | npt.ArrayLike) -> npt.NDArray[np.float64]:
    if isinstance(mesh, Mesh):
        return mesh.bounds
    vertices = arrays.as_points("mesh", mesh).astype(np.float64)
    if len(vertices) == 0 or not np.isfinite(vertices).all():
        raise ValueError(
            f"mesh must be a Mesh or at least one vertex, all finite, got {len(vertices)} vertices"
        )
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _viewing_distance(radius: float, camera: Camera | None) -> float:
    """Return how far from its centre a sphere is seen whole by a pinhole camera; 3 radii without one."""
    if camera is None or camera.model == "orthographic":
        return 3 * radius
    u = min(camera.cx, camera.width - 1 - camera.cx) / abs(camera.fx)
    v = min(camera.cy, camera.height - 1 - camera.cy) / abs(camera.fy)
    half_angle = math.atan(min(u, v))
    if half_angle <= 0:
        raise ValueError("distance must be given for a camera whose principal point is not in the image")
    return 1.05 * radius / math.sin(half_angle)
