"""Patches of images, and cells of plain colours, packed into one image and painted."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from nacre.meshing.texture_exposure import colors_at

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.intp]
Image = npt.NDArray[np.uint8]

MOST_PIXELS = 8192
"""Of an atlas, in width and height: what graphics cards hold."""

CELL = 4  # [pixels] in width and height, for a triangle without an image: three corners and a border
_BORDER = 2  # [pixels] around a patch: smaller copies of a texture mix neighbors
_ROUNDING = -1e-9  # of barycentric weights
_AT_ONCE = 1_000_000  # budget: pixels that are tested together


@dataclasses.dataclass(frozen=True, eq=False)
class Layout:
    """
    Where patches and cells are on an atlas.

    Attributes
    ----------
    width, height : int
        Of the atlas [pixels].
    corners : (P, 2)
        Of the patches: their first columns and rows on the atlas.
    cells : (C, 2)
        The same of the cells.
    """

    width: int
    height: int
    corners: Ints
    cells: Ints

    @property
    def fits(self) -> bool:
        """Whether a graphics card holds it."""
        return max(self.width, self.height) <= MOST_PIXELS


def pack(sizes: Ints, num_cells: int) -> Layout:
    """Lay rectangles of (P, 2) sizes in rows, the highest first, and rows of cells below them."""
    total = float(sizes.prod(axis=1).sum()) + num_cells * CELL**2
    widest = int(sizes[:, 0].max(initial=CELL))
    width = -(-max(math.ceil(1.03 * math.sqrt(total)), widest) // CELL) * CELL
    if widest <= MOST_PIXELS < width:
        width = MOST_PIXELS
    corners = np.zeros((len(sizes), 2), np.intp)
    left = top = row_height = 0
    for i in np.argsort(-sizes[:, 1], kind="stable").tolist():
        patch_width, patch_height = sizes[i].tolist()
        if left + patch_width > width:
            left, top, row_height = 0, top + row_height, 0
        corners[i] = left, top
        left, row_height = left + patch_width, max(row_height, patch_height)
    top += row_height
    across = width // CELL
    rows, columns = np.divmod(np.arange(num_cells), across)
    cells = np.stack([CELL * columns, top + CELL * rows], axis=1)
    height = top + -(-num_cells // across) * CELL
    return Layout(width, max(height, 1), corners, cells)


def rectangles(pixels: Array, groups: Ints, num_groups: int) -> tuple[Ints, Ints]:
    """Return the first (column, row) and the size of what holds each group of pixels, with a border."""
    lower = np.full((num_groups, 2), np.inf)
    upper = np.full((num_groups, 2), -np.inf)
    np.minimum.at(lower, groups, pixels)
    np.maximum.at(upper, groups, pixels)
    first = np.floor(lower).astype(np.intp) - _BORDER
    return first, np.ceil(upper).astype(np.intp) + _BORDER + 1 - first


def cut(image: Image, first: Ints, size: Ints) -> Image:
    """Return a rectangle of an image, whose border goes on beyond its edge."""
    columns, rows = (
        np.clip(np.arange(first[i], first[i] + size[i]), 0, image.shape[1 - i] - 1) for i in (0, 1)
    )
    rectangle: Image = image[rows[:, None], columns]
    return rectangle


def paint_cells(atlas: Image, cells: Ints, colors: Array) -> Array:
    """Paint cells with the (C, 3, 3) colours of triangles' corners; return (C, 3, 2), where those are."""
    inner = CELL - 3  # from the first corner to the others
    steps = (np.arange(CELL) - 1) / inner
    right, down = colors[:, 1] - colors[:, 0], colors[:, 2] - colors[:, 0]
    planes = (
        colors[:, 0][:, None, None]
        + steps[None, None, :, None] * right[:, None, None]
        + steps[None, :, None, None] * down[:, None, None]
    )
    rows = cells[:, 1, None, None] + np.arange(CELL)[None, :, None]
    columns = cells[:, 0, None, None] + np.arange(CELL)[None, None, :]
    atlas[rows, columns] = np.clip(np.rint(planes), 0, 255).astype(np.uint8)
    offsets: Array = np.array([(1, 1), (1 + inner, 1), (1, 1 + inner)], np.float64)
    return cells[:, None] + offsets


class Changes:
    """
    What is to be added to the pixels of an atlas, in triangles.

    Parameters
    ----------
    atlas : (H, W, 3) uint8
        As it is until :meth:`apply`.
    """

    def __init__(self, atlas: Image) -> None:
        self._atlas = atlas
        self._sums = np.zeros(atlas.shape, np.float32)
        self._is_covered = np.zeros(atlas.shape[:2], bool)
        self._num_beside = np.zeros(atlas.shape[:2], np.uint8)

    def add(self, triangles: Array, changes: Array) -> None:
        """Add to (T, 3, 2) triangles, columns and rows [pixels], the (T, 3, 3) changes of their corners."""
        for rows, pixels, weights in _covered_pixels(triangles):
            x, y = pixels.T
            self._sums[y, x] = np.einsum("pc,pck->pk", weights, changes[rows])
            self._is_covered[y, x] = True

    def add_beside(self, triangles: Array, changes: Array) -> None:
        """Add the same, after all others, to pixels beside triangles, which lookups at edges mix."""
        for rows, pixels, weights in _covered_pixels(triangles, _BORDER):
            x, y = pixels.T
            beside = ~self._is_covered[y, x]
            x, y = x[beside], y[beside]
            np.add.at(self._sums, (y, x), np.einsum("pc,pck->pk", weights, changes[rows])[beside])
            np.add.at(self._num_beside, (y, x), 1)

    def blend(self, triangles: Array, image: Image, pixels: Array, shares: Array, changes: Array) -> None:
        """
        Let another image have a share of triangles, which were added before, and of what is beside them.

        Parameters
        ----------
        triangles : (T, 3, 2)
            On the atlas.
        image : (H, W, 3) uint8
            The other one.
        pixels : (T, 3, 2)
            Where it shows the corners.
        shares : (T, 3)
            Its weights at the corners.
        changes : (T, 3, 3)
            What is added to its colours at the corners, less what is added to those of the atlas.
        """
        for rows, targets, weights in _covered_pixels(triangles, _BORDER):
            x, y = targets.T
            inside = (weights >= _ROUNDING).all(axis=1)
            is_taken = inside | ~self._is_covered[y, x]
            rows, weights, x, y = rows[is_taken], weights[is_taken], x[is_taken], y[is_taken]
            colors = colors_at(image.astype(np.float32), np.einsum("pc,pck->pk", weights, pixels[rows]))
            colors += np.einsum("pc,pck->pk", weights, changes[rows]) - self._atlas[y, x]
            share = np.clip((weights * shares[rows]).sum(axis=1), 0, 1)
            np.add.at(self._sums, (y, x), share[:, None] * colors)

    def apply(self) -> None:
        """Add all of it, and to the borders of the triangles what is beside them."""
        beside = self._num_beside > 0
        self._sums[beside] /= self._num_beside[beside, None]
        self._is_covered |= beside
        for _ in range(_BORDER):
            _grow(self._sums, self._is_covered)
        lines = max(1, _AT_ONCE // self._atlas.shape[1])
        for start in range(0, len(self._atlas), lines):
            part = slice(start, start + lines)
            changed = np.rint(self._atlas[part] + self._sums[part])
            self._atlas[part] = np.clip(changed, 0, 255).astype(np.uint8)


def _covered_pixels(triangles: Array, margin: float = 0.0) -> Iterator[tuple[Ints, Ints, Array]]:
    """
    Yield pixels within triangles: the triangle's row, column and row of the pixel, barycentric weights.

    Those within a margin [pixels] of them, too.
    """
    first = np.ceil(triangles.min(axis=1) - margin).astype(np.intp)
    sizes = np.maximum(np.floor(triangles.max(axis=1) + margin).astype(np.intp) + 1 - first, 0)
    least = _ROUNDING - margin / np.maximum(_heights(triangles), 1e-3)
    counts = sizes.prod(axis=1)
    ends = np.cumsum(counts)
    starts = np.searchsorted(ends, np.arange(0, int(counts.sum()), _AT_ONCE))
    for begin, end in zip(starts, [*starts[1:], len(triangles)], strict=True):
        rows = np.repeat(np.arange(begin, end), counts[begin:end])
        within = np.arange(len(rows)) - np.repeat(
            np.cumsum(counts[begin:end]) - counts[begin:end], counts[begin:end]
        )
        pixels = first[rows] + np.stack([within % sizes[rows, 0], within // sizes[rows, 0]], axis=1)
        weights = _barycentric(triangles[rows], pixels)
        inside = (weights >= least[rows]).all(axis=1)
        yield rows[inside], pixels[inside], weights[inside]


def _heights(triangles: Array) -> Array:
    """Return how far each corner is from the side across."""
    opposite = triangles[:, [2, 0, 1]] - triangles[:, [1, 2, 0]]
    area = np.abs(_cross(opposite[:, 0], opposite[:, 1]))
    heights: Array = area[:, None] / np.maximum(np.linalg.norm(opposite, axis=2), 1e-12)
    return heights


def _barycentric(triangles: Array, pixels: Ints) -> Array:
    a, b, c = (triangles[:, i] - pixels for i in range(3))
    weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    totals = weights.sum(axis=1, keepdims=True)
    return np.where(np.abs(totals) > 1e-12, weights / np.where(totals == 0, 1, totals), -1)


def _cross(a: Array, b: Array) -> Array:
    product: Array = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def _grow(values: npt.NDArray[np.float32], is_covered: Bools) -> None:
    """Give pixels beside covered ones their values."""
    before = is_covered.copy()
    for axis in (0, 1):
        for shift in (1, -1):
            to = tuple(
                slice(max(shift, 0), min(shift, 0) or None) if i == axis else slice(None) for i in (0, 1)
            )
            of = tuple(
                slice(max(-shift, 0), min(-shift, 0) or None) if i == axis else slice(None) for i in (0, 1)
            )
            rows, columns = np.nonzero(before[of] & ~is_covered[to])
            values[to][rows, columns] = values[of][rows, columns]
            is_covered[to][rows, columns] = True
