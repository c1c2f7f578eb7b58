"""Systematic errors of depth cameras, found from a recording that was tracked."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._core import Camera
from nacre._internal.arrays import as_camera, as_depth, as_pose
from nacre.depth import back_project, preprocess_depth

_log = logging.getLogger(__name__)

_BLOCK = 4  # pixels, each way, whose inverse depths are averaged
LEAST_TURN, _MOST_TURN = 0.1, 0.6  # between two views that are compared [rad]
MOST_VIEWS = 24
LEAST_VIEWS = 5  # those have enough pairs
_STEPS = 16
_LARGEST_STEP = 0.1  # of the stretch
_LEAST_PART = 1e-4  # of the information that the other unknowns leave; rounding leaves less
_AT_REST = 0.1  # of a standard deviation
_LEAST_PAIRS = 6
_LEAST_SIGMAS = 7.0
_LEAST_TILT = 0.002  # about the noise of the inverse depth of one pixel, structured light [1/m]
_LEAST_FOCAL_ERROR = 0.04  # recordings whose focal length was calibrated, and depth was not, show up to 0.03
_GATE = 0.05  # of the depth: surfaces that are farther apart are not the same
_MOST_CHANGE = 0.5  # a correction that changes depth by more is none

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class DepthCalibration:
    """
    How the inverse depth of a camera is off from one side of the image to the other, and its focal length.

    Structured light and stereo measure a disparity along the image's rows, which is ``fx * baseline``
    times the inverse depth. Where pattern and camera, or the two cameras, do not fit each other quite in
    direction or focal length, it is off in proportion to the column, and so is the inverse depth.

    Attributes
    ----------
    tilt : float
        Measured less true inverse depth, for each unit of x / z (1/m): a depth z at x / z = 1 is about
        ``tilt * z**2`` too small.
    sigma : float
        Its standard deviation, from how much pairs of views differ (1/m); infinite with fewer than two.
    num_pairs : int
        Pairs of views that it is from.
    focal_scale : float
        The focal length that makes the views agree best, by the camera's. Depth that is wrong by a factor
        shows the same, inverted: a scene that is stretched along the camera's axis.
    focal_sigma : float
        Its standard deviation, likewise.
    """

    tilt: float
    sigma: float
    num_pairs: int
    focal_scale: float = 1.0
    focal_sigma: float = math.inf

    @property
    def is_significant(self) -> bool:
        """Whether the error matters (0.002 / m) and is beyond doubt (seven sigma, six pairs)."""
        is_sure = self.num_pairs >= _LEAST_PAIRS and abs(self.tilt) > _LEAST_SIGMAS * self.sigma
        return is_sure and abs(self.tilt) > _LEAST_TILT

    @property
    def has_wrong_focal_length(self) -> bool:
        """Whether the focal length is off by more than 4 %, beyond doubt (seven sigma, six pairs)."""
        error = abs(self.focal_scale - 1.0)
        is_sure = self.num_pairs >= _LEAST_PAIRS and error > _LEAST_SIGMAS * self.focal_sigma
        return is_sure and error > _LEAST_FOCAL_ERROR

    def focal_length_advice(self, camera: Camera) -> str:
        """
        Return which focal length a camera seems to have.

        Parameters
        ----------
        camera : Camera
            The pinhole camera that was calibrated.

        Returns
        -------
        str
            A sentence; empty where the camera's focal length is not clearly wrong.

        Raises
        ------
        TypeError, ValueError
            It is no camera, or no pinhole camera.
        """
        _check_camera(camera)
        if not self.has_wrong_focal_length:
            return ""
        fx, fy = (self.focal_scale * length for length in (camera.fx, camera.fy))
        return (
            f"views in different directions fit each other best with fx {fx:.0f} and fy {fy:.0f} pixels, "
            f"{self.focal_scale:.2f} times what the camera says (sigma {self.focal_sigma:.3f}): "
            "its focal length is wrong, or the depth by the inverse factor"
        )

    def correct(self, depth: npt.ArrayLike, camera: Camera) -> npt.NDArray[np.float32]:
        """
        Return a depth image without the error.

        Parameters
        ----------
        depth : (H, W) array
            Metres.
        camera : Camera
            A pinhole camera.

        Returns
        -------
        (H, W) float32
            Metres; NaN where the correction would be more than a half, which no calibration reaches.

        Raises
        ------
        ValueError
            If the camera is not a pinhole camera or the image does not have its size.
        """
        _check_camera(camera)
        image = _checked(depth, camera)
        side = _rays(camera)[..., 0]
        with np.errstate(invalid="ignore"):
            factor = 1.0 - self.tilt * side * image
            corrected = np.where(np.abs(factor - 1.0) < _MOST_CHANGE, image / factor, np.nan)
        return corrected.astype(np.float32)


def calibrate_depth(views: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]], camera: Camera) -> DepthCalibration:
    """
    Find the systematic error of depth and the focal length that make overlapping views agree best.

    Two views of one surface from different directions see it in different columns, stretched along
    different axes; what the tilt of the inverse depth, a focal length and their relative pose together
    explain is fitted to all pairs of successive views that are 0.1 to 0.6 rad apart (point to plane, Gauss
    and Newton, robust). Poses need to be about right only. The idea, to calibrate depth by what overlaps in
    a recording, is that of Teichman, Miller and Thrun 2013.

    Parameters
    ----------
    views : iterable of (depth, world_from_camera)
        Depth images (H, W) in metres and poses (4, 4), in the order of the recording. Views that turned by
        less than 0.1 rad are skipped; at most 24 are used.
    camera : Camera
        A pinhole camera.

    Returns
    -------
    DepthCalibration
        With ``num_pairs`` 0 where no two views tell anything.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; not a pinhole camera, or an image or a pose does
        not fit.
    """
    _check_camera(camera)
    chosen = _choose(views, camera)
    pairs = [
        _Pair(a, b)
        for step in (1, 2)
        for a, b in zip(chosen, chosen[step:], strict=False)
        if LEAST_TURN <= turn_between(a.pose, b.pose) <= _MOST_TURN
    ]
    distortion = np.array([0.0, 1.0])  # the tilt, and by how much the scene is too narrow
    for _ in range(_STEPS):
        found = [fit for pair in pairs if (fit := pair.linearised(distortion, camera)) is not None]
        if len(found) < 2:
            return DepthCalibration(0.0, math.inf, len(found))
        covariance = np.linalg.inv(sum(information for information, _ in found))
        step = -covariance @ sum(gradient for _, gradient in found)
        # From the scatter, as neighbours share their errors; two pairs share a view.
        left = np.array([gradient + information @ step for information, gradient in found])
        sigmas = np.sqrt(2.0 * np.diag(covariance @ np.einsum("ni,nj->ij", left, left) @ covariance))
        step *= min(1.0, _LARGEST_STEP / max(abs(float(step[1])), 1e-12))
        distortion = distortion + step
        if (np.abs(step) < _AT_REST * sigmas).all():
            break
        for pair in pairs:
            pair.follow(step)
    (tilt, stretch), (sigma, stretch_sigma) = distortion.tolist(), sigmas.tolist()
    _log.info("depth is tilted by %.4f / m, sigma %.4f / m, by %d pairs of views", tilt, sigma, len(found))
    return DepthCalibration(tilt, sigma, len(found), 1.0 / stretch, stretch_sigma / stretch**2)


@dataclass(frozen=True)
class _View:
    """A view in blocks of pixels: points as measured, NaN where there are none; its pose."""

    points: Array
    pose: Array


class _Pair:
    """Two views, their relative pose, and what they say of tilt and stretch."""

    def __init__(self, first: _View, second: _View) -> None:
        self.first, self.second = first, second
        self.motion = np.linalg.inv(first.pose) @ second.pose
        self._solution: Array | None = None

    def linearised(self, distortion: Array, camera: Camera) -> tuple[Array, Array] | None:
        """Return the information on tilt and stretch, and the gradient, which the pose leaves."""
        self._solution = None
        target, source = (_corrected(view.points, distortion) for view in (self.first, self.second))
        normals, source_normals = _normals(target).reshape(-1, 3), _normals(source).reshape(-1, 3)
        smooth = np.isfinite(source_normals[:, 0])
        source_normals = source_normals[smooth]
        rotation, shift = self.motion[:3, :3], self.motion[:3, 3]
        moved = _turned(source.reshape(-1, 3)[smooth], rotation) + shift
        seen_by = _blocks_that_see(moved / [distortion[1], distortion[1], 1.0], camera)
        matched = seen_by >= 0
        p, q, n = moved[matched], target.reshape(-1, 3)[seen_by[matched]], normals[seen_by[matched]]
        residual = np.einsum("ij,ij->i", q - p, n)
        facing = np.einsum("ij,ij->i", _turned(source_normals[matched], rotation), n)
        good = (np.abs(residual) < _GATE * q[:, 2]) & (facing > 0.85)
        if good.sum() < 200:
            return None
        p, q, n, residual = p[good], q[good], n[good], residual[good]
        # Both derivatives at the middle of the two points: at the points themselves, their noise would
        # favour whatever makes the scene smaller.
        middle = 0.5 * (p + q)
        local = _turned(middle - shift, rotation.T)
        slope = np.einsum("ij,ij->i", n, middle * middle[:, :1] - _turned(local * local[:, :1], rotation))
        wide, wide_local = middle * [1.0, 1.0, 0.0], local * [1.0, 1.0, 0.0]
        widening = np.einsum("ij,ij->i", n, wide - _turned(wide_local, rotation)) / distortion[1]
        rows_of_pose = -np.concatenate([np.cross(p, n), n], axis=1)
        depth = q[:, 2]
        noise = depth**2 / np.median(depth**2)
        whitened = residual / noise
        scale = 1.4826 * max(float(np.median(np.abs(whitened))), 1e-9)
        weight = 1.0 / (noise * scale * (1.0 + (whitened / (3.0 * scale)) ** 2)) ** 2
        # Sums by einsum: those of a BLAS depend on its threads.
        rows = np.column_stack([rows_of_pose, slope, widening, residual])
        sums = np.einsum("n,ni,nj->ij", weight, rows, rows)
        hessian = sums[:6, :6] + 1e-9 * np.trace(sums[:6, :6]) * np.eye(6)
        solution = np.linalg.solve(hessian, sums[:6, 6:])
        left = sums[6:8, 6:] - sums[6:8, :6] @ solution
        if not (np.diag(left) > _LEAST_PART * np.diag(sums)[6:8]).all():
            return None
        self._solution = solution
        return left[:, :2], left[:, 2]

    def follow(self, step: Array) -> None:
        """Take the pose that belongs to a step of tilt and stretch."""
        if self._solution is None:
            return
        twist = -self._solution @ [*step, 1.0]
        motion = np.eye(4)
        motion[:3, :3] = _rotation(twist[:3])
        motion[:3, 3] = twist[3:6]
        self.motion = motion @ self.motion


def _choose(views: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]], camera: Camera) -> Sequence[_View]:
    chosen: list[_View] = []
    rays = _rays(camera)
    for depth, pose in views:
        matrix = as_pose("world_from_camera", pose)
        if len(chosen) == MOST_VIEWS:
            break
        if not chosen or turn_between(chosen[-1].pose, matrix) >= LEAST_TURN:
            chosen.append(_View(_average(preprocess_depth(_checked(depth, camera), camera), rays), matrix))
    return chosen


def _average(depth: npt.NDArray[np.float32], rays: Array) -> Array:
    """Return one point for each block of pixels, from the mean of their inverse depths."""
    height, width = (size // _BLOCK * _BLOCK for size in depth.shape)
    cut = (slice(height), slice(width))
    split = (height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK)
    inverse = np.moveaxis(1.0 / depth[cut].astype(np.float64).reshape(split), 2, 1)
    directions = np.moveaxis(rays[cut].reshape(*split, 3), 2, 1)
    inverse = inverse.reshape(*inverse.shape[:2], -1)
    whole: npt.NDArray[np.bool_] = np.asarray(np.isfinite(inverse).all(axis=2))
    z = np.where(whole, 1.0 / np.where(whole[..., None], inverse, 1.0).mean(axis=2), np.nan)
    points: Array = directions.mean(axis=(2, 3)) * z[..., None]
    return points


def _corrected(points: Array, distortion: Array) -> Array:
    """Return measured points without the tilt (1 / z less tilt * x / z), and stretched across the axis."""
    tilt, stretch = distortion
    corrected: Array = points / (1.0 - tilt * points[..., :1]) * [stretch, stretch, 1.0]
    return corrected


def _normals(points: Array) -> Array:
    """Return normals from the neighbours to all sides, towards the camera; NaN beside steps."""
    normals = np.full(points.shape, np.nan)
    across = points[1:-1, 2:] - points[1:-1, :-2]
    down = points[2:, 1:-1] - points[:-2, 1:-1]
    product = np.cross(down, across)
    product /= np.sqrt(np.einsum("...i,...i->...", product, product))[..., None]
    steep = np.maximum(np.abs(across[..., 2]), np.abs(down[..., 2])) > 0.1 * points[1:-1, 1:-1, 2]
    product[steep] = np.nan
    normals[1:-1, 1:-1] = product
    return normals


def _blocks_that_see(points: Array, camera: Camera) -> npt.NDArray[np.int64]:
    """Return the block of pixels that sees each point, -1 where none does."""
    columns, rows = (camera.width // _BLOCK, camera.height // _BLOCK)
    u, v = camera.project(points).T  # NaN behind the camera
    column, row = np.floor((u + 0.5) / _BLOCK), np.floor((v + 0.5) / _BLOCK)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    return np.where(inside, np.nan_to_num(row) * columns + np.nan_to_num(column), -1.0).astype(np.int64)


def _rays(camera: Camera) -> Array:
    """Return (x / z, y / z, 1) of every pixel; NaN where the distortion model ends before the image does."""
    size = camera.height * camera.width
    # A depth that is the pixel's number, so that pixels without a ray show as those left out.
    depth = 1.0 + np.arange(size, dtype=np.float64) / size
    points = back_project(depth.reshape(camera.height, camera.width).astype(np.float32), camera).astype(
        np.float64
    )
    rays = np.full((size, 3), np.nan)
    rays[np.rint((points[:, 2] - 1.0) * size).astype(np.int64)] = points / points[:, 2:]
    return rays.reshape(camera.height, camera.width, 3)


def _turned(points: Array, rotation: Array) -> Array:
    turned: Array = np.einsum("nj,ij->ni", points, rotation)
    return turned


def turn_between(a: Array, b: Array) -> float:
    """Return the angle between the directions of two poses [rad]."""
    trace = float(np.sum(a[:3, :3] * b[:3, :3]))
    return math.acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))


def _rotation(vector: Array) -> Array:
    """Return the rotation matrix of a rotation vector, Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-12:
        return np.eye(3)
    rotation: Array = np.eye(3) + math.sin(angle) / angle * cross
    rotation += (1.0 - math.cos(angle)) / angle**2 * cross @ cross
    return rotation


def can_calibrate(camera: Camera) -> bool:
    """Say whether the depth of a camera can be calibrated: pinhole, with depth along its axis."""
    return camera.model == "pinhole" and camera.depth == "z"


def _checked(depth: npt.ArrayLike, camera: Camera) -> npt.NDArray[np.float32]:
    image = as_depth("depth", depth)
    if image.shape != (camera.height, camera.width):
        raise ValueError(f"depth: expected {camera.height} x {camera.width} pixels, got {image.shape}")
    return image


def _check_camera(camera: Camera) -> None:
    as_camera("camera", camera)
    if not can_calibrate(camera):
        raise ValueError(f"camera: expected a pinhole camera with depth along its axis, got {camera!r}")
