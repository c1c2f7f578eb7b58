"""One recording of a batch, as a worker reconstructs it: by the code of ``nacre reconstruct``."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre._internal.camera_names import is_camera
from nacre.datasets.detect import require_format
from nacre.errors import FileFormatError, RunError, explain
from nacre.evaluation.result import plain
from nacre.io.cameras import read_camera
from nacre.io.writable_folder import writable_folder
from nacre.reconstruction.batch.result import BatchResult, Outcome, failed, finished
from nacre.reconstruction.batch.thumbnail import write_thumbnail
from nacre.reconstruction.carry_out import carry_out
from nacre.reconstruction.job import begin_run, resume_run
from nacre.reconstruction.resume import UnfinishedRun
from nacre.reconstruction.run_options import RunOptions, checked
from nacre.run_data.saved_run import SavedRun
from nacre.system import __version__

if TYPE_CHECKING:
    from nacre.parameters import ModelParameters

_PAUSE = 0.2  # [s] between two looks whether another process has left a folder


@dataclass(frozen=True)
class Task:
    """What a worker is asked for: a recording, its options, and the folder for its results."""

    name: str
    options: RunOptions
    parameters: ModelParameters
    folder: Path
    overwrite: bool = False
    checkpoint_every: int | None = None
    version: str = __version__  #: of who asks: another one may give other bytes

    @property
    def empty_result(self) -> BatchResult:
        """The result while nothing is done."""
        return BatchResult(self.name, self.options.source, self.folder)


def make_tasks(
    recordings: Mapping[str, Path],
    options: RunOptions,
    parameters: ModelParameters,
    output: Path,
    *,
    overwrite: bool = False,
    checkpoint_every: int | None = None,
) -> list[Task]:
    """
    Return a task for each recording, with absolute paths: workers may be anywhere.

    Raises
    ------
    FileNotFoundError, FileFormatError, TypeError, ValueError
        Options that no recording can have.
    """
    checked(options)
    for path in recordings.values():
        if not path.exists() and is_camera(Path(path.name)):
            raise ValueError(f"sources must be recordings, and {path.name} is a camera")
    if options.format is not None:
        require_format(options.format)
    if options.camera is not None:
        read_camera(options.camera)
        options = dataclasses.replace(options, camera=str(Path(options.camera).absolute()))

    def options_for(path: Path) -> RunOptions:
        """Return the options with the folders of a recording."""
        return dataclasses.replace(
            options,
            source=str(path),
            masks=None if options.masks is None else str(path / options.masks),
            attribute=[_within(path, text) for text in options.attribute],
        )

    folder = output.absolute()
    return [
        Task(name, options_for(path), parameters, folder / name, overwrite, checkpoint_every)
        for name, path in recordings.items()
    ]


def _within(path: Path, attribute: str) -> str:
    name, equals, images = attribute.partition("=")
    return f"{name}{equals}{path / images}" if images else attribute


def reconstruct_recording(task: Task) -> BatchResult:
    """
    Reconstruct a recording, unless that is done; go on where it was begun.

    What is wrong with the recording is told by the result. Errors that may not come again (a full disk, too
    little memory) are raised: the cluster tries again.
    """
    try:
        if task.version != __version__:
            raise RunError(f"the worker has nacre {__version__}, the batch {task.version}")
        with closing(UnfinishedRun(writable_folder(task.folder), task.checkpoint_every)) as unfinished:
            _wait_for_the_folder(unfinished)
            return _reconstruct(task, unfinished)
    except Exception as error:
        message, code = explain(error)
        if isinstance(error, (OSError, MemoryError)) and code == 1:
            raise
        with suppress(OSError):
            task.folder.rmdir()  # where nothing was written
        return failed(task.empty_result, message)


def _wait_for_the_folder(unfinished: UnfinishedRun) -> None:
    """Wait while another process writes to it: one that the scheduler has lost, or another program."""
    while True:
        try:
            unfinished.hold()
        except BlockingIOError:
            time.sleep(_PAUSE)
        else:
            return


def _reconstruct(task: Task, unfinished: UnfinishedRun) -> BatchResult:
    try:
        outcome = _go_on(task, unfinished)
    except (FileFormatError, RunError) as error:
        if not task.overwrite:
            raise RunError(f"{error}; overwrite begins it again") from error
        outcome = None
    if outcome is None:
        carry_out(begin_run(task.options, unfinished, task.parameters))
        outcome = "reconstructed"
    write_thumbnail(task.folder)
    return finished(task.empty_result, SavedRun(task.folder), outcome, task.options.min_tracked)


def _go_on(task: Task, unfinished: UnfinishedRun) -> Outcome | None:
    """Go on with what the folder holds, and return what became of it; None: it holds nothing."""
    if unfinished.document_path.exists():
        _require_same_options("begun", unfinished.document()["options"], task.options)
        carry_out(resume_run(unfinished))
        return "resumed"
    names = ["model.ply", "report.json", *["report.html"] * task.options.report]
    if not all((task.folder / name).is_file() for name in names):
        return None
    saved = SavedRun(task.folder)
    report, is_tracked = saved.report, any(frame.world_from_camera is not None for frame in saved.frames)
    if is_tracked and not (task.folder / "trajectory.txt").is_file():
        return None
    if report.get("interrupted"):
        return None
    _require_same_options("done", report.get("options", {}), task.options)
    return "finished before"


def _require_same_options(state: str, before: Mapping[str, Any], options: RunOptions) -> None:
    now = plain(dataclasses.asdict(options))
    names = [name for name in now if name not in before or before[name] != now[name]]
    if names:
        told = ", ".join(f"{name} was {before.get(name)!r}, is {now[name]!r}" for name in names)
        raise RunError(f"it was {state} with other options: {told}")
