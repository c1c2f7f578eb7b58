"""Frames of depth images that the caller holds, or that come one by one."""

from __future__ import annotations

import collections.abc
from collections.abc import Iterable, Iterator
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre.camera import Camera
from nacre.datasets.sequence import SequenceFrame


class HeldFrames(collections.abc.Sequence[SequenceFrame]):
    """
    Frames of items in memory, each made when it is asked for.

    Parameters
    ----------
    camera : Camera or None
        Of the depth images; frames have their own.
    depth_scale : float, optional
        Stored units per metre. Without it floats are metres.
    of_integers : float, optional
        The same for integers alone, where ``depth_scale`` is None.
    items : sequence
        Depth images, pairs of depth and colour, or frames. More come with :meth:`receive`.
    """

    def __init__(
        self,
        camera: Camera | None,
        depth_scale: float | None = None,
        of_integers: float | None = None,
        items: collections.abc.Sequence[Any] | npt.NDArray[Any] = (),
    ) -> None:
        if camera is not None:
            arrays.as_camera("camera", camera)
        self._camera = camera
        self._scales = {"f": depth_scale or 1.0, "i": depth_scale or of_integers}
        self._items = items

    def __len__(self) -> int:
        return len(self._items)

    @overload
    def __getitem__(self, index: int) -> SequenceFrame: ...
    @overload
    def __getitem__(self, index: slice) -> list[SequenceFrame]: ...
    def __getitem__(self, index: int | slice) -> SequenceFrame | list[SequenceFrame]:
        places = range(len(self))[index]
        return self._frame(places) if isinstance(places, int) else [self._frame(place) for place in places]

    def receive(self, items: Iterable[Any]) -> Iterator[int]:
        """Take items as they come, and yield the index of each."""
        kept = list(self._items)
        self._items = kept
        for item in items:
            kept.append(item)
            yield len(kept) - 1

    def _frame(self, index: int) -> SequenceFrame:
        item = self._items[index]
        if isinstance(item, SequenceFrame):
            return item
        name = f"source[{index}]"
        if self._camera is None:
            raise ValueError(
                f"camera must be given with depth images: nacre.Camera(width, height, fx, fy, cx, cy), or "
                f"nacre.Camera.from_fov(width, height, horizontal_degrees); {name} got none"
            )
        shape = (self._camera.height, self._camera.width)
        given, color = item if isinstance(item, tuple) and len(item) == 2 else (item, None)
        stored = arrays.as_real(name, given)
        if stored.shape != shape:
            raise ValueError(
                f"{name} must be a depth image of the camera's shape {shape}, got {stored.shape}"
                + "; source must be a list of depth images: give [depth]" * (stored.ndim == 1)
            )
        scale = self._scales["i" if stored.dtype.kind in "ui" else "f"]
        if scale is None:
            raise ValueError(
                "depth_scale must be given with depth images of integers: the stored units per metre (1000 "
                f"for millimetres), got None and {stored.dtype}"
            )
        depth = arrays.as_depth(name, stored, scale)
        pixels = None if color is None else arrays.as_colors(f"the colours of {name}", color, (*shape, 3))
        return SequenceFrame(index, depth, self._camera, None, pixels, None)


def first_of(source: Iterable[Any]) -> tuple[Any, Iterable[Any]]:
    """Return the first item, and all of them; raise a ValueError where there is none."""
    if isinstance(source, collections.abc.Sequence | np.ndarray):
        if not len(source):
            raise ValueError("source must have at least one frame, got none")
        return source[0], source
    rest = iter(source)
    for first in rest:
        return first, _with_first(first, rest)
    raise ValueError("source must have at least one frame, got none")


def _with_first(first: Any, rest: Iterator[Any]) -> Iterator[Any]:
    yield first
    yield from rest
