"""Many recordings become models, in one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from nacre._internal.arrays import as_count, as_flag
from nacre._internal.core_options import updated
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.parameters import ModelParameters, Preset
from nacre.progress import as_progress
from nacre.reconstruction.batch.result import BatchResult
from nacre.reconstruction.batch.run import BatchRun
from nacre.reconstruction.batch.sources import Sources, find_recordings
from nacre.reconstruction.batch.task import make_tasks
from nacre.reconstruction.run_options import RunOptions, changed_parameters


@guided("recordings, and the folder for the results")
def batch(
    sources: Sources,
    output: str | os.PathLike[str],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    overwrite: bool = False,
    progress: Callable[[BatchResult], bool | None] | None = None,
    format: str | None = None,
    camera: str | os.PathLike[str] | None = None,
    depth_scale: float | None = None,
    masks: str | os.PathLike[str] | None = None,
    attributes: Mapping[str, str | os.PathLike[str]] | None = None,
    color: bool = True,
    first: int = 0,
    last: int | None = None,
    every: int = 1,
    retry: bool = True,
    all_points: bool = False,
    report: bool = True,
    min_tracked: float = 0.5,
    preset: Preset = "default",
    parameters: ModelParameters | None = None,
    **changes: Any,
) -> list[BatchResult]:
    """
    Reconstruct many recordings, each by a process of its own, as ``nacre batch`` does.

    Each gets a folder ``output/NAME`` with the files that ``nacre reconstruct`` writes, and the same bytes;
    ``output/index.html`` and ``output/index.json`` tell of all. What is finished there is left as it is, and
    what was killed goes on. Needs Dask: ``pip install "nacre[dask]"``.

    Parameters
    ----------
    sources : path-like, or iterable of path-like
        Recordings of any format that :func:`nacre.open_sequence` knows; folders of recordings; patterns such
        as ``"scans/*"``; ``"@list.txt"``, a text file with one of these a line.
    output : path-like
        The folder for the results; with a scheduler elsewhere, one that all machines see.
    workers : int, optional
        How many local processes; None: one for each processor. The processors are divided among them.
    scheduler : str, optional
        The address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers are to do it.
    overwrite : bool
        Do again what is there with other options, or damaged; without it that is refused.
    progress : callable, optional
        Called with each result when it is there. To return False, or to raise :class:`nacre.Cancelled`, ends
        the batch; called again, it goes on.
    format, camera, depth_scale
        As in :func:`nacre.open_sequence`, of all recordings; ``camera`` is a file.
    masks : path-like, optional
        A folder of masks, whose path begins at each recording.
    attributes : mapping of str to path-like, optional
        Folders of images of anything else, whose paths begin at each recording, by the attributes' names.
    color : bool
        Whether the models get colours.
    first, last, every : int
        Which frames of each recording: from the first to the last, every so many.
    retry : bool
        Whether lost frames are tried again at the end.
    all_points : bool
        Whether points that are no surface are written, too.
    report : bool
        Whether ``report.html`` is written.
    min_tracked : float
        Where a smaller part of the frames is tracked, the result's ``message`` says so.
    preset, parameters, **changes
        As in :class:`nacre.Model`.

    Returns
    -------
    list of BatchResult
        One for each recording, in their order.

    Raises
    ------
    ImportError
        Dask is missing, with the command that installs it.
    FileNotFoundError, FileFormatError
        Nothing fits a pattern; a list or the camera file cannot be read. A recording that fails stops
        nothing: its result says why.
    ConnectionError
        Nobody answers at the scheduler's address.
    BlockingIOError
        Another batch is writing to the folder.
    RuntimeError
        The local processes did not start, as in a script that is not guarded, see below.
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Notes
    -----
    The processes import the script that calls this: there it stands below ``if __name__ == "__main__":``.

    Examples
    --------
    >>> results = nacre.batch("scans/*", "models", every=2, progress=print)  # doctest: +SKIP
    >>> [result.name for result in results if result.level != "ok"]  # doctest: +SKIP
    """
    given = ModelParameters.preset(preset) if parameters is None else parameters
    of_model = updated(as_kind("parameters", given, ModelParameters, "nacre.ModelParameters"), changes)
    if not isinstance(attributes, Mapping | None):
        raise TypeError(f"attributes must be folders by their names, got {attributes!r}")
    options = RunOptions(
        source="",
        format=format,
        camera=_path("camera", camera),
        depth_scale=depth_scale,
        masks=_path("masks", masks),
        attribute=[f"{name}={_path('attributes', folder)}" for name, folder in (attributes or {}).items()],
        color=color,
        first=first,
        last=last,
        every=every,
        retry=retry,
        preset=preset,
        all_points=all_points,
        report=report,
        min_tracked=min_tracked,
        parameters=changed_parameters(of_model),
    )
    if not isinstance(scheduler, str | None):
        raise TypeError(f"scheduler must be an address, got {scheduler!r}")
    folder = _path("output", output)
    if not folder:
        raise ValueError(f"output must be a folder, got {output!r}")
    tasks = make_tasks(
        find_recordings(sources), options, of_model, Path(folder), overwrite=as_flag("overwrite", overwrite)
    )
    goes_on = None if progress is None else as_progress("progress", progress)
    run = BatchRun(
        tasks, Path(folder), None if workers is None else as_count("workers", workers, minimum=1), scheduler
    )
    with closing(run.results()) as results:
        for result in results:
            if goes_on is not None and not goes_on(result):
                break
    return run.index.results


def _path(name: str, value: Any) -> str | None:
    if value is None and name != "output":
        return None
    if not isinstance(value, str | os.PathLike) or "\0" in os.fspath(value):
        raise TypeError(f"{name} must be a path, got {value!r}")
    return str(os.fspath(value))
