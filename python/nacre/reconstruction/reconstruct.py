"""A recording becomes a model, in one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nacre._internal.arrays import as_count
from nacre._internal.guided import guided
from nacre._internal.names_elsewhere import SOME_FRAMES
from nacre.camera import Camera
from nacre.datasets import Sequence as Recording
from nacre.datasets import SequenceFrame, open_sequence
from nacre.datasets.held_frames import HeldFrames, first_of
from nacre.io.cameras import read_camera
from nacre.model import Model
from nacre.parameters import ModelParameters, Preset
from nacre.reconstruction.pieces.motions import PieceMotions
from nacre.reconstruction.pieces.workers import Cluster
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.run_options import RunOptions
from nacre.run_data.frame_record import FrameRecord


@guided("a recording, or a list of depth images with camera=", **SOME_FRAMES)
def reconstruct(
    source: str | os.PathLike[str] | Iterable[Any],
    *,
    format: str | None = None,
    camera: Camera | str | os.PathLike[str] | None = None,
    depth_scale: float | None = None,
    preset: Preset = "default",
    parameters: ModelParameters | None = None,
    progress: Callable[[FrameRecord], bool | None] | None = None,
    retry: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    points_folder: str | os.PathLike[str] | None = None,
    **changes: Any,
) -> Reconstruction:
    """
    Run a recording through a new model, as ``nacre reconstruct`` does.

    Parameters
    ----------
    source : path-like, or iterable
        A recording of any format that :func:`nacre.open_sequence` knows, or one that is open. Or views in
        their order, a list, an array or a generator: depth images, (H, W) arrays or paths; pairs of a depth
        and a colour image; or frames (:class:`nacre.SequenceFrame`). What a generator gives is kept, for the
        lost frames are gone over again.
    format
        As in :func:`nacre.open_sequence`; for a path only.
    camera : Camera or path-like, optional
        The depth camera, or a camera file; needed for depth images, and in place of what a recording says.
    depth_scale : float, optional
        Stored units per metre, in place of what a recording or the camera file says. Arrays of floats are
        metres without it; integers need it.
    preset, parameters, points_folder, **changes
        As in :class:`nacre.Model`.
    progress : callable, optional
        Called with each :class:`~nacre.reconstruction.FrameRecord` when it is done. To return False, or to
        raise :class:`nacre.Cancelled`, ends the run; what is done is the result, whose ``cancelled`` says so.
    retry : bool
        Whether lost frames are tried again at the end.
    workers : int, optional
        Cut the recording into overlapping pieces, which so many local processes track at the same time; needs
        a path for the source, and Dask: ``pip install "nacre[dask]"``. The result is the same for any number
        of workers, but not that of one process alone. A script that calls this does so below
        ``if __name__ == "__main__":``.
    scheduler : str, optional
        The same by the workers of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``; all see one disk.

    Returns
    -------
    Reconstruction
        With ``model``, ``frames``, ``trajectory``, ``depth_calibration``, and ``evaluation`` where the
        recording knows the truth.

    Raises
    ------
    FileNotFoundError, FileFormatError
        There is no recording, or not one that can be read; the message says what to do.
    TypeError, ValueError
        Naming the argument, what was expected and what came. Where the model refuses every frame, what it
        says of the first.
    ImportError, ConnectionError
        Dask is missing; nobody answers at the scheduler's address, it went away, or worker after worker died.

    Examples
    --------
    >>> done = nacre.reconstruct("my-recording", progress=print)  # doctest: +SKIP
    >>> nacre.write_points("model.ply", done.model)  # doctest: +SKIP
    >>> done = nacre.reconstruct(depth_images, camera=camera, depth_scale=1000)  # doctest: +SKIP
    """
    frames, of_all, indices = _opened(source, format, camera, depth_scale)
    model = Model(of_all, preset, parameters=parameters, points_folder=points_folder, **changes)
    done, motions = Reconstruction(frames, model), None
    if workers is not None or scheduler is not None:
        if not isinstance(source, str | os.PathLike):
            raise TypeError(f"source must be a path where workers open it too, got {type(source).__name__}")
        if not isinstance(camera, str | os.PathLike | None):
            raise TypeError("camera must be a file where workers read it too, got a Camera")
        if not isinstance(scheduler, str | None):
            raise TypeError(f"scheduler must be an address, got {scheduler!r}")
        cluster = Cluster(None if workers is None else as_count("workers", workers, minimum=1), scheduler)
        options = RunOptions(
            os.path.abspath(source),  # noqa: PTH100  links keep their names
            format,
            None if camera is None else os.path.abspath(camera),  # noqa: PTH100
            depth_scale,
        )
        motions = PieceMotions.of(
            options, model.parameters, range(len(frames)), folder=Path.cwd(), kept_in=None, cluster=cluster
        )
    done.complete(indices, progress=progress, retry=retry, motions=motions)
    errors = [frame.error for frame in done.frames]
    if errors and errors[0] is not None and None not in errors:
        raise errors[0]
    return done


def _opened(
    source: str | os.PathLike[str] | Iterable[Any],
    format: str | None,
    camera: Camera | str | os.PathLike[str] | None,
    depth_scale: float | None,
) -> tuple[Sequence[SequenceFrame], Camera, Iterable[int] | None]:
    """Return the frames of a source, their camera, and their indices, where they come one by one."""
    if isinstance(source, str | os.PathLike):
        recording = open_sequence(source, format=format, camera=camera, depth_scale=depth_scale)
        return recording, recording.camera, None
    if not isinstance(source, Iterable) or isinstance(source, Mapping):
        raise TypeError(f"source must be a path or a sequence of frames, got {type(source).__name__}")
    if isinstance(source, Recording):
        _refuse("this one is open", format=format, camera=camera, depth_scale=depth_scale)
        if not len(source):
            raise ValueError("source must have at least one frame, got none")
        return source, source.camera, None
    first, items = first_of(source)
    depth = first[0] if isinstance(first, tuple) and first else first
    if isinstance(depth, str | os.PathLike):
        recording = open_sequence(items, format=format, camera=camera, depth_scale=depth_scale)
        return recording, recording.camera, None
    if not isinstance(first, SequenceFrame):
        _refuse("these are arrays", format=format)
        return _held(first, items, camera, depth_scale)
    _refuse("its frames have their own", format=format, camera=camera, depth_scale=depth_scale)
    if isinstance(items, Sequence):
        return items, first.camera, None
    held = HeldFrames(None)
    return held, first.camera, held.receive(items)


def _refuse(why: str, **given: Any) -> None:
    for name, value in given.items():
        if value is not None:
            raise ValueError(f"{name} is not for this source, {why}; got {value!r}")


def _held(
    first: Any,
    items: Iterable[Any],
    camera: Camera | str | os.PathLike[str] | None,
    depth_scale: float | None,
) -> tuple[HeldFrames, Camera, Iterable[int] | None]:
    """Return frames of depth images in memory; the first is made at once, so that its errors come first."""
    of_integers = None
    if isinstance(camera, str | os.PathLike):
        found = read_camera(camera)
        camera, of_integers = found.camera, found.depth_scale
    held = HeldFrames(camera, depth_scale, of_integers, [first])
    of_all = held[0].camera
    if isinstance(items, Sequence | np.ndarray):
        held = HeldFrames(camera, depth_scale, of_integers, items)
        return held, of_all, None
    held = HeldFrames(camera, depth_scale, of_integers)
    return held, of_all, held.receive(items)
