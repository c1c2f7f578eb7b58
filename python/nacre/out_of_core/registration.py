"""ICP between clouds larger than memory."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.guided import guided
from nacre.io.cloud import Cloud
from nacre.io.points import write_chunks
from nacre.out_of_core.memory import as_bytes
from nacre.out_of_core.rows import to_cloud
from nacre.out_of_core.run import require_streamed
from nacre.out_of_core.survey import PathLike, Source, Survey, finite_rows, survey
from nacre.registration import AlignResult
from nacre.registration import align as align_in_memory

_ROWS_AT_ONCE = 1 << 18


@guided("two point files, or folders of them", init="initial")
def align(
    source: PathLike | Iterable[PathLike],
    target: PathLike | Iterable[PathLike],
    output: PathLike | None = None,
    *,
    memory: int | str | None = None,
    **options: Any,
) -> AlignResult:
    """
    Find the rigid motion that brings one cloud onto another, from a first guess; both may exceed memory.

    As :func:`nacre.align`, of the 100 000 points of each cloud whose coordinates have the lowest hashes: a
    random sample, the same in whatever order the points come.

    Parameters
    ----------
    source, target : path-like, or iterable of path-like
        As in :func:`nacre.out_of_core.consolidate`.
    output : path-like, optional
        The file to write the moved source to, in its order, with all that its points have.
    memory : int or str, optional
        As in :func:`nacre.out_of_core.consolidate`.
    **options
        Those of :func:`nacre.align` but for what belongs to single points.

    Returns
    -------
    AlignResult
        The file is not written where ``status`` is "too_few_pairs".

    Raises
    ------
    TypeError, ValueError, FileFormatError, OSError, ImportError
        As :func:`nacre.out_of_core.consolidate` does.

    Examples
    --------
    >>> align("flight2.laz", "flight1.laz", "moved.laz", max_distance=2.0).rmse  # doctest: +SKIP
    """
    if output is not None:
        require_streamed(Path(os.fspath(output)))
    moving, still = Source.of(source), Source.of(target)
    available = as_bytes("memory", memory)
    for files in (moving, still):
        files.check_memory(available)
    of_source, of_target = survey(moving, _ROWS_AT_ONCE), survey(still, _ROWS_AT_ONCE)
    result = align_in_memory(of_source.sample, of_target.sample, **options)
    if output is not None and result.status != "too_few_pairs":
        _write_moved(moving, of_source, result.target_from_source, Path(os.fspath(output)))
    return result


def _write_moved(source: Source, of: Survey, pose: npt.NDArray[np.float64], output: Path) -> None:
    corners = np.array(list(itertools.product(*zip(of.lower, of.upper, strict=True))))
    moved = corners @ pose[:3, :3].T + pose[:3, 3]
    extremes = np.array([moved.min(axis=0), moved.max(axis=0)])

    def chunks() -> Iterator[Cloud]:
        for rows in finite_rows(source, of, _ROWS_AT_ONCE):
            cloud = to_cloud(rows)
            rows["points"] = cloud.points @ pose[:3, :3].T + pose[:3, 3]
            if cloud.normals is not None:
                rows["normals"] = cloud.normals @ pose[:3, :3].T
            yield to_cloud(rows)

    write_chunks(output, chunks(), of.num_points, extremes)
