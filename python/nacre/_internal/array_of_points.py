"""What has points is taken for them."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from nacre._internal.guided import GuidedNames


class ArrayOfPoints(GuidedNames):
    """What has points is taken for them by NumPy's functions, and so by nacre's."""

    __slots__ = ()

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """Return the points (N, 3)."""
        points: npt.NDArray[Any] = self.points  # type: ignore[attr-defined]
        array = points.astype(points.dtype if dtype is None else dtype, copy=bool(copy))
        if copy is False and array is not points:
            raise ValueError(f"copy must be True or None for points as {array.dtype}, got False")
        return array
