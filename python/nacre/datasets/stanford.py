"""
Range scans of the Stanford 3D Scanning Repository: PLY files with a range grid, placed by a ``.conf`` file.

A scan's columns are evenly spaced in x, its rows only nearly so in y, and every other row may be shifted by
half a column. So each scan is resampled: its grid cells become triangles, seen by an orthographic camera that
looks along -z of the scanner. One camera serves all scans of a folder.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import FARTHEST
from nacre._internal.quaternions import matrix_from_quaternion
from nacre.camera import Camera
from nacre.datasets.listing import describe, files
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.ply import read_range_grid
from nacre.io.raw import decode, read_file
from nacre.trajectory import Trajectory

FORMAT = "stanford"
LAYOUT = "range scans (.ply with a range_grid), optionally placed by a .conf file; or one such scan"

# A triangle with a side longer than this many sample distances bridges a gap between two surfaces.
_LONGEST_SIDE = 4.0
_MOST_ROW_DISTANCE = 16.0  # of a scan that is one image [distance of columns]
_MOST_SPREAD = 16  # pixels of the common view for each cell of the largest grid

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """
    The orthographic camera before all scans, in the scanner's frame.

    A point (x, y, z) of a scan is (x - centre_x, centre_y - y, plane_z - z) in the camera's frame [m].
    """

    width: int
    height: int
    pixel_size: float
    centre_x: float
    centre_y: float
    plane_z: float

    @property
    def scan_from_camera(self) -> Float64:
        """The camera's pose in the scanner's frame: half a turn about x, and the centre."""
        pose = np.diag([1.0, -1.0, -1.0, 1.0])
        pose[:3, 3] = self.centre_x, self.centre_y, self.plane_z
        return pose


def recognise(path: Path) -> bool:
    """Say whether a file is a range scan, or a folder holds one."""
    candidates = files(path, (".ply",)) if path.is_dir() else [path]
    return any(_has_range_grid(candidate) for candidate in candidates)


def read(path: Path, given: Overrides) -> Sequence:
    """Open a folder of range scans, or one scan. Reads every scan once to see how far they reach."""
    scans = files(path, (".ply",)) if path.is_dir() else [path]
    scans = [scan for scan in scans if _has_range_grid(scan)]
    if not scans:
        raise FileFormatError(path, f"no range scan (.ply with a range_grid) here; found {describe(path)}")
    if given.camera is not None:
        raise ValueError(
            "camera must not be given for range scans: the camera that sees them follows from the scans"
        )
    scale = given.scale_or(1.0)
    try:
        view = common_view(_read_all(scans, scale))
        camera = Camera.orthographic(width=view.width, height=view.height, pixel_size=view.pixel_size)
    except FileFormatError:
        raise
    except ValueError as error:
        raise FileFormatError(path, f"no camera sees these range scans: {error}") from error
    placed = _read_conf(path if path.is_dir() else path.parent, scale)
    poses = [placed[scan.name] @ view.scan_from_camera if scan.name in placed else None for scan in scans]
    known = [(i, pose) for i, pose in enumerate(poses) if pose is not None]
    return Sequence(
        path,
        format=FORMAT,
        camera=camera,
        depth_scale=scale,
        sources=[
            FrameSource(i, scan, truth=pose) for i, (scan, pose) in enumerate(zip(scans, poses, strict=True))
        ],
        truth=Trajectory(np.array([i for i, _ in known]), np.array([pose for _, pose in known]))
        if known
        else None,
        load_depth=partial(_load, scale=scale, view=view),
    )


def common_view(scans: Iterable[Float64]) -> View:
    """
    Return the camera that sees all scans, with the first scan's column distance as its pixel size.

    A ValueError says why there is none.
    """
    pixel_size, low, high, num_cells = 0.0, np.full(3, np.inf), np.full(3, -np.inf), 0
    for scan in scans:
        low = np.fmin(low, np.nanmin(scan, axis=(0, 1)))
        high = np.fmax(high, np.nanmax(scan, axis=(0, 1)))
        num_cells = max(num_cells, scan[..., 0].size)
        if not pixel_size > 0:
            pixel_size = float(f"{_median(np.abs(np.diff(scan[..., 0], axis=1))):.5g}")
    if not pixel_size > 0:
        raise ValueError("no two columns of a scan are apart in x")
    columns, rows = ((high[k] - low[k]) / pixel_size for k in (0, 1))
    if not (columns + 1) * (rows + 1) <= _MOST_SPREAD * num_cells:
        reason = f"with {pixel_size:.3g} m between columns they are {columns:.3g} x {rows:.3g} pixels"
        raise ValueError(f"{reason}, and have at most {num_cells} points each")
    width, height = (int(np.ceil(extent - 0.01)) + 1 for extent in (columns, rows))
    return View(
        width=width,
        height=height,
        pixel_size=pixel_size,
        centre_x=low[0] + (width - 1) / 2 * pixel_size,
        centre_y=low[1] + (height - 1) / 2 * pixel_size,
        plane_z=high[2] + float(np.max(high - low)),
    )


def resample(scan: Float64, view: View) -> npt.NDArray[np.float32]:
    """
    Return the depth image of an organised cloud (H, W, 3).

    Its triangles are drawn into the image by linear interpolation; of several at a pixel the nearest counts.
    """
    u = (scan[..., 0] - view.centre_x) / view.pixel_size + (view.width - 1) / 2
    v = (view.centre_y - scan[..., 1]) / view.pixel_size + (view.height - 1) / 2
    corners = np.stack([u, v, view.plane_z - scan[..., 2]], axis=-1).reshape(-1, 3)[_triangles(scan)]
    p, q, r = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(q - p, r - p)

    first = np.ceil(corners[..., :2].min(axis=1) - 1e-9).astype(int)
    last = np.floor(corners[..., :2].max(axis=1) + 1e-9).astype(int)
    depth = np.full((view.height, view.width), np.inf)
    for dv, du in np.ndindex(*(np.max(last - first, axis=0, initial=-1) + 1)[::-1]):
        pixel = first + np.array((du, dv))
        k = np.flatnonzero((pixel <= last).all(axis=1) & (area != 0))
        at = pixel[k]
        to_p, to_q, to_r = p[k, :2] - at, q[k, :2] - at, r[k, :2] - at
        weights = (
            np.stack([_cross(to_q, to_r), _cross(to_r, to_p), _cross(to_p, to_q)], axis=-1) / area[k, None]
        )
        inside = (
            (weights >= -1e-9).all(axis=1)
            & (at >= 0).all(axis=1)
            & (at < (view.width, view.height)).all(axis=1)
        )
        values = (weights * corners[k, :, 2]).sum(axis=1)
        np.minimum.at(depth, (at[inside, 1], at[inside, 0]), values[inside])
    depth[np.isinf(depth)] = np.nan
    return depth.astype(np.float32)


def _median(values: Float64) -> float:
    """Return the median of the finite ones; 0 if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else 0.0


def _triangles(scan: Float64) -> npt.NDArray[np.intp]:
    """Return the grid's triangles, indices (N, 3), that lie on one surface and face the scanner."""
    rows, columns = scan.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        index[:-1, :-1].ravel(),
        index[:-1, 1:].ravel(),
        index[1:, :-1].ravel(),
        index[1:, 1:].ravel(),
    )
    points = scan.reshape(-1, 3)
    # A cell is cut along its shorter diagonal; with one corner missing the half without it remains.
    ad, bc = _distance(points, a, d), _distance(points, b, c)
    along_ad = np.isnan(bc) | (ad <= bc)
    along_bc = np.isnan(ad) | (bc < ad)
    cells = np.concatenate(
        [
            np.stack([a, b, d], axis=-1)[along_ad],
            np.stack([a, d, c], axis=-1)[along_ad],
            np.stack([a, b, c], axis=-1)[along_bc],
            np.stack([b, d, c], axis=-1)[along_bc],
        ]
    )
    sides = np.stack([_distance(points, cells[:, i], cells[:, i - 1]) for i in range(3)])
    sample = _median(_distance(points, a, c))
    cells = cells[(sides <= _LONGEST_SIDE * sample).all(axis=0)]
    p, q, r = points[cells[:, 0], :2], points[cells[:, 1], :2], points[cells[:, 2], :2]
    turn = np.sign(_cross(q - p, r - p))
    facing: npt.NDArray[np.intp] = cells[turn == np.sign(turn.sum())]
    return facing


def _distance(points: Float64, i: npt.NDArray[np.intp], j: npt.NDArray[np.intp]) -> Float64:
    distance: Float64 = np.linalg.norm(points[i] - points[j], axis=-1)
    return distance


def _cross(a: Float64, b: Float64) -> Float64:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _load(path: Path, scale: float, view: View) -> npt.NDArray[np.float32]:
    scan = _read_scan(path, scale)
    row_distance = _median(np.linalg.norm(np.diff(scan, axis=0), axis=-1))
    if row_distance > _MOST_ROW_DISTANCE * view.pixel_size:
        reason = f"its rows are {row_distance:.3g} m apart, columns of the first scan {view.pixel_size:.3g} m"
        raise FileFormatError(path, reason)
    return resample(scan, view)


def _read_scan(path: Path, scale: float) -> Float64:
    with np.errstate(over="ignore"):
        scan = read_range_grid(path).astype(np.float64) / scale
    is_there = (np.abs(scan) <= FARTHEST).all(axis=-1)
    scan[~is_there] = np.nan
    if is_there.sum() < 3:
        raise FileFormatError(path, "the range scan has fewer than 3 points")
    return scan


def _read_all(paths: list[Path], scale: float) -> Iterator[Float64]:
    """Read the scans one by one; one that is broken is told when its view is asked for, unless all are."""
    broken: FileFormatError | None = None
    any_good = False
    for path in paths:
        try:
            scan = _read_scan(path, scale)
        except FileFormatError as error:
            broken = broken or error
            continue
        any_good = True
        yield scan
    if not any_good and broken is not None:
        raise broken


def _has_range_grid(path: Path) -> bool:
    if path.suffix.lower() != ".ply":
        return False
    with path.open("rb") as stream:
        header = stream.read(8192).split(b"end_header", 1)[0]
    return header.startswith(b"ply") and re.search(rb"\nelement\s+range_grid\s", header) is not None


def _read_conf(folder: Path, scale: float) -> dict[str, Float64]:
    """
    Read where the scans lie: ``bmesh file tx ty tz qx qy qz qw`` means R(conjugate of q) p + t.

    The lines ``camera`` and ``mesh`` do not place scans.
    """
    poses: dict[str, Float64] = {}
    for conf in sorted(folder.glob("*.conf")):
        for number, line in enumerate(decode(read_file(conf)).splitlines(), start=1):
            words = line.split()
            if not words or words[0] != "bmesh":
                continue
            try:
                tx, ty, tz, qx, qy, qz, qw = (float(word) for word in words[2:])
                rotation = matrix_from_quaternion((-qx, -qy, -qz, qw))
                shift = np.array((tx, ty, tz)) / scale
                if not (np.abs(shift) <= FARTHEST).all():
                    raise ValueError
            except ValueError as error:
                raise FileFormatError(
                    conf,
                    f"expected 'bmesh file tx ty tz qx qy qz qw', got {line.strip()[:60]!r}",
                    line=number,
                ) from error
            pose = np.eye(4)
            pose[:3, :3] = rotation
            pose[:3, 3] = shift
            poses[words[1]] = pose
    return poses
