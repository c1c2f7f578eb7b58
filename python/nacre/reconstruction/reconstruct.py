"""A recording becomes a model, in one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, cast

from nacre import Camera
from nacre.datasets import Sequence as Recording
from nacre.datasets import SequenceFrame, open_sequence
from nacre.model import Model
from nacre.parameters import ModelParameters, Preset
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.runner import Run


def reconstruct(
    source: str | os.PathLike[str] | Sequence[SequenceFrame],
    *,
    format: str | None = None,
    camera: Camera | str | os.PathLike[str] | None = None,
    depth_scale: float | None = None,
    preset: Preset = "default",
    parameters: ModelParameters | None = None,
    progress: Callable[[FrameRecord], bool | None] | None = None,
    retry: bool = True,
    **changes: Any,
) -> Reconstruction:
    """
    Run a recording through a new model, as ``nacre reconstruct`` does.

    Parameters
    ----------
    source : path-like or sequence of SequenceFrame
        A recording of any format that :func:`nacre.open_sequence` knows, or one that is open, or a list of
        frames.
    format, camera, depth_scale
        As in :func:`nacre.open_sequence`; for a path only.
    preset, parameters, **changes
        As in :class:`nacre.Model`.
    progress : callable, optional
        Called with each :class:`~nacre.reconstruction.FrameRecord` when it is done. To return False, or to
        raise :class:`nacre.Cancelled`, ends the run; what is done is the result, whose ``cancelled`` says so.
    retry : bool
        Whether lost frames are tried again at the end.

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
        Naming the argument, what was expected and what came.

    Examples
    --------
    >>> done = nacre.reconstruct("my-recording", progress=print)  # doctest: +SKIP
    >>> nacre.write_points("model.ply", done.model.points, normals=done.model.normals)  # doctest: +SKIP
    """
    frames: Sequence[SequenceFrame]
    if isinstance(source, (str, os.PathLike)):
        frames = open_sequence(source, format=format, camera=camera, depth_scale=depth_scale)
    elif not isinstance(source, Sequence):
        raise TypeError(f"source must be a path or a sequence of frames, got {type(source).__name__}")
    else:
        for name, value in (("format", format), ("camera", camera), ("depth_scale", depth_scale)):
            if value is not None:
                raise ValueError(f"{name} is for a source that is a path: this one is open, got {value!r}")
        frames = cast(Sequence[SequenceFrame], source)
    if not len(frames):
        raise ValueError("source must have at least one frame, got none")
    of_all = frames.camera if isinstance(frames, Recording) else frames[0].camera
    model = Model(of_all, preset, parameters=parameters, **changes)
    return Run(Reconstruction(frames, model), range(len(frames)), retry=retry).to_end(progress)
