"""A z-buffer of disks, in numpy: points become a closed, shaded surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Float32 = npt.NDArray[np.float32]

_MAX_SPLAT = 40.0  # pixels
_FRONT = np.array([0.95, 0.925, 0.885])
_REVERSE = np.array([0.72, 0.52, 0.38])
_KEY_LIGHT = np.array([-0.55, -0.65, -0.52])  # towards the light: from the upper left, in front


class Canvas:
    """A z-buffer with normals and colours. Its border has room for disks whose center lies just outside."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.border = 2 * int(_MAX_SPLAT) + 1
        self.width, self.height = size
        self.stride = self.width + 2 * self.border
        self.num_pixels = self.stride * (self.height + 2 * self.border)
        self.depth = np.full(self.num_pixels, np.inf, dtype=np.float32)
        self.reverse = np.zeros(self.num_pixels, dtype=bool)
        self.weight = np.zeros(self.num_pixels, dtype=np.float32)
        self.normal = np.zeros((self.num_pixels, 3), dtype=np.float32)
        self.albedo: Float32 | None = None

    def draw(
        self, seen: Float32, facing: Float32, spacing: Float32, albedo: npt.NDArray[np.uint8] | None
    ) -> None:
        """Draw disks at ``seen`` (pixels from the middle of the picture, depth in pixels)."""
        column = np.floor(seen[:, 0] + self.width / 2).astype(np.int64)
        row = np.floor(seen[:, 1] + self.height / 2).astype(np.int64)
        edge = int(_MAX_SPLAT)
        inside = (
            (column >= -edge) & (column < self.width + edge) & (row >= -edge) & (row < self.height + edge)
        )
        pixel = (row + self.border) * self.stride + column + self.border

        nearest_last = np.flatnonzero(inside)
        nearest_last = nearest_last[np.argsort(-seen[nearest_last, 2], kind="stable")]
        winner = np.full(self.num_pixels, -1, dtype=np.int64)
        winner[pixel[nearest_last]] = nearest_last
        drawn = winner[winner >= 0]  # one point per pixel: no two of them ever meet at the same offset
        radius = np.clip(np.where(facing[:, 2] > 0, 0.7, 1.0) * spacing, 0.75, _MAX_SPLAT)
        drawn = drawn[np.argsort(-radius[drawn], kind="stable")]

        pixel, depth, facing = pixel[drawn], seen[drawn, 2], facing[drawn]
        reverse = facing[:, 2] > 0
        tilt = np.where(reverse, np.maximum(facing[:, 2], 0.2), np.minimum(facing[:, 2], -0.2))
        slope_x, slope_y = -facing[:, 0] / tilt, -facing[:, 1] / tilt
        radius = radius[drawn]
        offsets = _disk_offsets(float(radius.max(initial=0)))
        for dx, dy, reach in offsets:
            count = int(np.searchsorted(-radius, -reach, side="right"))
            rise = slope_x[:count] * dx + slope_y[:count] * dy
            target = pixel[:count] + (dy * self.stride + dx)
            candidate = depth[:count] + rise
            nearer = (reach**2 + rise**2 <= radius[:count] ** 2) & (candidate < self.depth[target])
            self.depth[target[nearer]] = candidate[nearer]
            self.reverse[target[nearer]] = reverse[:count][nearer]

        if albedo is not None:
            self.albedo = np.zeros((self.num_pixels, 3), dtype=np.float32)
            colors = albedo[drawn].astype(np.float32) / 255
        for dx, dy, reach in offsets:
            count = int(np.searchsorted(-radius, -reach, side="right"))
            rise = slope_x[:count] * dx + slope_y[:count] * dy
            target = pixel[:count] + (dy * self.stride + dx)
            squared = (reach**2 + rise**2) / radius[:count] ** 2
            blended = (
                (squared <= 1)
                & (depth[:count] + rise <= self.depth[target] + radius[:count] + 0.5)
                & (reverse[:count] == self.reverse[target])
            )
            target = target[blended]
            weight = np.exp(-4 * squared[blended])
            self.weight[target] += weight
            self.normal[target] += weight[:, None] * facing[:count][blended]
            if self.albedo is not None:
                self.albedo[target] += weight[:, None] * colors[:count][blended]

    def picture(self, background: tuple[int, int, int] | None) -> npt.NDArray[np.uint8]:
        """Shade what was drawn."""
        cut = (slice(self.border, -self.border),) * 2
        shape = (-1, self.stride)
        weight = self.weight.reshape(shape)[cut]
        normal = self.normal.reshape(*shape, 3)[cut].astype(np.float64)
        depth = self.depth.reshape(shape)[cut]
        covered = weight > 0
        length = np.linalg.norm(normal, axis=2)
        normal /= np.where(length > 0, length, 1)[:, :, None]
        toward = -normal[:, :, 2]
        side = np.where(toward < 0, -1.0, 1.0)
        lambert = 0.8 * np.abs(toward) + 0.2 * np.maximum(side * (normal @ _KEY_LIGHT), 0)
        if self.albedo is None:
            reverse = np.clip(-4 * toward - 0.6, 0, 1)[:, :, None]
            base = (1 - reverse) * _FRONT + reverse * _REVERSE
            shade = 0.22 + 0.78 * lambert
        else:
            base = self.albedo.reshape(*shape, 3)[cut] / np.where(covered, weight, 1)[:, :, None]
            shade = 0.55 + 0.45 * lambert
        brightness = shade * _cavity(depth, covered) * covered
        image = np.concatenate([np.clip(base * brightness[:, :, None], 0, 1), covered[:, :, None]], axis=2)
        image = _smooth_edges(image, np.where(covered, depth, np.inf))
        opacity = image[:, :, 3:]
        if background is None:
            image[:, :, :3] /= np.where(opacity > 0, opacity, 1)
        else:
            image = image[:, :, :3] + (1 - opacity) * np.asarray(background) / 255
        return np.clip(image * 255, 0, 255).round().astype(np.uint8)


def _disk_offsets(radius: float) -> list[tuple[int, int, float]]:
    reach = int(radius)
    offsets = [
        (dx, dy, float(np.hypot(dx, dy)))
        for dy in range(-reach, reach + 1)
        for dx in range(-reach, reach + 1)
    ]
    return sorted((o for o in offsets if o[2] <= radius), key=lambda o: (o[2], o[1], o[0]))


def _cavity(depth: Float32, covered: npt.NDArray[np.bool_]) -> Array:
    """Return each pixel's brightness by its depth against its surroundings (Luft et al. 2006)."""
    factor = np.ones(depth.shape)
    if not covered.any():
        return factor
    reach = max(min(depth.shape) // 60, 2)
    known = np.where(covered, depth, 0)
    for radius, strength in ((reach, 0.30), (3 * reach, 0.25)):
        total, count = known, covered.astype(np.float64)
        for _ in range(2):  # two boxes make a tent, which leaves no visible border
            total, count = _box_sum(total, radius), _box_sum(count, radius)
        behind = (depth[covered] - total[covered] / count[covered]) / radius
        factor[covered] *= 1 - strength * np.tanh(np.maximum(behind, -0.3))
    return factor


def _smooth_edges(image: Array, depth: Float32) -> Array:
    """Blur a picture by a pixel where its depth jumps, so that outlines are not ragged."""
    height, width = depth.shape
    padded = np.pad(depth, 1, mode="edge")
    jump = np.zeros(depth.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0), (1, 2), (2, 1)):
        other = padded[dy : dy + height, dx : dx + width]
        both = np.isfinite(other) & np.isfinite(depth)
        step = np.subtract(other, depth, out=np.zeros_like(depth), where=both)
        jump |= (np.isfinite(other) != np.isfinite(depth)) | (np.abs(step) > 6)
    v, u = np.nonzero(jump)
    wide = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    kernel = (0.25, 0.5, 0.25)
    smooth = image.copy()
    smooth[v, u] = sum(kernel[i] * kernel[j] * wide[v + i, u + j] for i in range(3) for j in range(3))
    return smooth


def _box_sum(image: npt.NDArray[np.floating], radius: int) -> Array:
    """Return the sum over the square of 2 radius + 1 pixels around each pixel."""
    total = image.astype(np.float64)
    for axis in (0, 1):
        length = total.shape[axis]
        cumulative = np.insert(np.cumsum(total, axis=axis), 0, 0, axis=axis)
        place = np.arange(length)
        total = cumulative.take(np.minimum(place + radius + 1, length), axis) - cumulative.take(
            np.maximum(place - radius, 0), axis
        )
    return total
