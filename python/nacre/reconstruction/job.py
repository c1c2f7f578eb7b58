"""A run of ``nacre reconstruct``: new, or one that was stopped."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nacre._internal.signals import Interruption
from nacre.datasets import Sequence as Recording
from nacre.datasets import open_sequence
from nacre.datasets.recorder import mend
from nacre.errors import FileFormatError, RunError
from nacre.io.atomic import remove_leftovers
from nacre.io.writable_folder import writable_folder
from nacre.model import Model
from nacre.parameters import ModelParameters
from nacre.reconstruction.description import describe, describe_camera
from nacre.reconstruction.live_feed import LiveFeed, camera_feed, real_time_feed
from nacre.reconstruction.pieces.motions import PieceMotions
from nacre.reconstruction.pieces.workers import Cluster
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.resume import UnfinishedRun, read_document
from nacre.reconstruction.run_options import (
    RunOptions,
    check_recording,
    may_park,
    options_before,
)
from nacre.reconstruction.runner import Run

if TYPE_CHECKING:
    from nacre.viewer import Controls

_log = logging.getLogger(__name__)


@dataclass
class Job:
    """A run that may have been begun before; where frames come by themselves there is a feed."""

    options: RunOptions
    sequence: Recording
    words: str
    num_frames: int | None
    run: Run
    unfinished: UnfinishedRun
    feed: LiveFeed | None = None
    controls: Controls | None = None


def begin_run(
    options: RunOptions,
    unfinished: UnfinishedRun,
    parameters: ModelParameters,
    stop: Interruption | None = None,
    cluster: Cluster | None = None,
    controls: Controls | None = None,
) -> Job:
    """Open what is asked for, and note it in ``OUT/unfinished``."""
    out = unfinished.out
    stop = stop or Interruption()
    feed: LiveFeed | None = None
    indices: Iterable[int]
    chosen = range(0)
    if options.is_camera:
        feed = camera_feed(
            Path(options.source),
            writable_folder(out),
            options.color,
            options.pick,
            stop=stop,
            controls=controls,
        )
        sequence, num_frames = feed.sequence, None
        words, indices = f"live, {describe_camera(sequence.camera)}", feed
    else:
        sequence = options.open()
        chosen = options.indices(sequence)
        words, num_frames, indices = describe(sequence, chosen), len(chosen), chosen
        if options.realtime:
            indices = feed = real_time_feed(sequence, chosen, stop=stop, controls=controls)
    folder = unfinished.points_folder if may_park(parameters) else None
    done = Reconstruction(sequence, Model(sequence.camera, parameters=parameters, points_folder=folder))
    writable_folder(out)
    _hold(unfinished)
    remove_leftovers(out)
    for mesh in sorted(out.glob("mesh.*")):
        _log.warning("%s is of an earlier model: nacre mesh %s makes it anew", mesh, out)
    if unfinished.checkpoint.exists():
        _log.warning("%s held an unfinished run, which could have gone on: it is begun again", out)
    run = Run(done, indices, retry=options.retry)
    if options.pieces:
        run.motions = _motions(run, options, Path.cwd(), chosen, unfinished, cluster)
    unfinished.live = None if feed is None else feed.figures
    unfinished.begin(run, options.document(sequence))
    return Job(options, sequence, words, num_frames, run, unfinished, feed, controls if feed else None)


def resume_run(unfinished: UnfinishedRun, cluster: Cluster | None = None) -> Job:
    """Open what a run was asked for that was stopped or killed, and load what it had."""
    out = unfinished.out
    if out.is_dir():
        _hold(unfinished)
    document = read_document(unfinished)
    options, folder = options_before(document, unfinished.document_path)
    indices: Sequence[int]
    chosen = range(0)
    if options.is_camera:
        mend(out / "recording")
        sequence = open_sequence(out / "recording")
        words, indices = f"live, {describe_camera(sequence.camera)}", range(len(sequence))
    else:
        sequence = options.open(folder)
        check_recording(document, sequence)
        chosen = options.indices(sequence)
        words = describe(sequence, chosen)
        # Of a recording in real time what it had seen; which frames come, is the clock's doing.
        indices = _journaled_indices(unfinished, sequence) if options.realtime else chosen
    for place in (out, unfinished.folder):
        remove_leftovers(place)
    compare = not options.is_camera  # its colours were kept as JPEG
    run = unfinished.resume(sequence, indices, compare=compare, retry=options.retry)
    if options.pieces:
        run.motions = _motions(run, options, folder, chosen, unfinished, cluster)
    live = unfinished.live
    if live is not None and len(run.done.frames) < len(
        unfinished.journaled_indices()
    ):  # nobody counted since
        unfinished.live = {**live, "num_received": None, "num_dropped": None}
    return Job(options, sequence, words, len(indices), run, unfinished)


def _journaled_indices(unfinished: UnfinishedRun, sequence: Recording) -> list[int]:
    indices = unfinished.journaled_indices()
    if max(indices, default=0) >= len(sequence):
        reason = f"frame {max(indices)} is none of the recording's {len(sequence)}"
        raise FileFormatError(unfinished.journal_path, reason)
    return indices


def _motions(
    run: Run,
    options: RunOptions,
    folder: Path,
    indices: range,
    unfinished: UnfinishedRun,
    cluster: Cluster | None,
) -> PieceMotions:
    """Return what the workers of a cluster will find; the first piece of the frames is the run's own."""
    if options.is_camera or options.realtime:
        raise RunError(
            "pieces are cut of a recording that is there, not of frames that come by themselves", 2
        )
    return PieceMotions.of(
        options,
        run.done.model.parameters,
        indices,
        folder=folder,
        kept_in=unfinished.folder,
        cluster=cluster or Cluster(),
    )


def _hold(unfinished: UnfinishedRun) -> None:
    try:
        unfinished.hold()
    except BlockingIOError:
        raise RunError(
            f"another nacre reconstruct is writing to {unfinished.out}: wait until it has ended; "
            "a new run can go to another folder (-o)",
            2,
        ) from None
