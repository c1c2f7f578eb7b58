"""``OUT/unfinished``: what a run is resumed from that was stopped or killed."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from nacre._internal.arrays import as_count
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import FileFormatError, RunError
from nacre.io.atomic import atomic_writer, remove_leftovers
from nacre.io.folder_lock import lock_folder
from nacre.io.json_files import read_json
from nacre.reconstruction.journal import Journal, read_journal
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.runner import Run
from nacre.run_data.frame_record import FrameRecord

_FORMAT = 1
_RARE = 50.0  # a checkpoint is written when so many times what the last one took has gone by: 2 % of the time
_LEAST_SECONDS = 5.0


class UnfinishedRun:
    """
    The folder ``OUT/unfinished``: run.json (what was asked for), journal.txt, checkpoint, points.

    Parameters
    ----------
    out : Path
        The folder of the results.
    every : int, optional
        A checkpoint after so many frames; 0: only where the run is stopped. None: by time, see above.

    Attributes
    ----------
    live : mapping or None
        What report.json says of a camera.
    """

    def __init__(self, out: Path, every: int | None = None) -> None:
        self.out = out
        self.folder = out / "unfinished"
        self.live: Mapping[str, Any] | None = None
        self._every = every
        self._run: Run | None = None
        self._journal: Journal | None = None
        self._lock: int | None = None
        self._num_since = 0
        self._next = time.monotonic() + _LEAST_SECONDS

    @property
    def checkpoint(self) -> Path:
        """The file of the newest checkpoint."""
        return self.folder / "checkpoint"

    @property
    def points_folder(self) -> Path:
        """Where points of the model go that the camera has left behind."""
        return self.folder / "points"

    @property
    def document_path(self) -> Path:
        """The file that says what was asked for."""
        return self.folder / "run.json"

    @property
    def journal_path(self) -> Path:
        """The file with a line for each frame that is done."""
        return self.folder / "journal.txt"

    def hold(self) -> None:
        """Keep other processes from writing to ``OUT`` until this is closed; BlockingIOError: one does."""
        if self._lock is None:
            self._lock = lock_folder(self.out)

    def begin(self, run: Run, document: Mapping[str, Any]) -> None:
        """Begin a new run; what was left of another goes."""
        self._clear()
        self.folder.mkdir(exist_ok=True)
        if run.done.model.parks_points:
            self.points_folder.mkdir()
        self._run = run
        self._journal = Journal(self.journal_path)
        self.save()
        data = json.dumps({"format": _FORMAT, **document}, indent=2, default=str)
        with atomic_writer(self.document_path) as stream:  # the last: from here on it can be resumed
            stream.write(data.encode() + b"\n")

    def document(self) -> dict[str, Any]:
        """Return what ``run.json`` says; FileNotFoundError: there is nothing to resume."""
        path = self.document_path
        found = read_json(path)
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise FileFormatError(
                path, "it was written by another version of nacre: the run must begin again"
            )
        if not isinstance(found.get("options"), dict):
            raise FileFormatError(path, "options must be an object: it is no run of nacre reconstruct")
        return found

    def resume(
        self, sequence: Sequence[SequenceFrame], indices: Sequence[int], *, compare: bool, retry: bool
    ) -> Run:
        """Return the run as it was at the newest checkpoint; what is done again may be compared."""
        folder = self.points_folder if self.points_folder.is_dir() else None
        done, more = Reconstruction._load(self.checkpoint, sequence, folder)
        try:
            live = more["live"]
            if not (live is None or isinstance(live, dict)):
                raise ValueError(f"live must be an object or null, got {live!r}")
            num_frames = as_count("num_journaled", more["num_journaled"])
        except (KeyError, TypeError, ValueError) as error:
            raise FileFormatError(self.checkpoint, f"it is no run of nacre reconstruct ({error})") from None
        self.live = live
        self._run = Run(done, indices, retry=retry)
        self._journal = Journal(self.journal_path, num_frames, compare)
        return self._run

    def journaled_indices(self) -> list[int]:
        """Return which frames had been done, in order, each once."""
        return list(dict.fromkeys(entry[0] for entry in read_journal(self.journal_path)[0]))

    def add(self, frame: FrameRecord) -> None:
        """Note a frame that is done; write a checkpoint where it is time."""
        assert self._journal is not None
        self._journal.add(frame)
        self._num_since += 1
        due = time.monotonic() >= self._next if self._every is None else self._num_since == self._every
        if due:
            self.save()

    def save(self) -> None:
        """Write a checkpoint."""
        assert self._journal is not None
        assert self._run is not None
        start = time.monotonic()
        self._journal.sync()
        self._run.done._save(self.checkpoint, live=self.live, num_journaled=self._journal.num_frames)
        now = time.monotonic()
        self._next = now + max(_LEAST_SECONDS, _RARE * (now - start))
        self._num_since = 0

    def close(self) -> None:
        """Close the journal, and let others write to the folder of the results."""
        self._close_journal()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def remove(self) -> None:
        """Remove the folder: the run is finished."""
        self._close_journal()
        self._clear()
        self.close()

    def _close_journal(self) -> None:
        if self._journal is not None:
            self._journal.close()
            self._journal = None

    def _clear(self) -> None:
        remove_leftovers(self.folder)
        pieces = self.folder.glob("piece-*.json")
        for path in (
            self.document_path,
            self.checkpoint,
            self.journal_path,
            *pieces,
        ):  # no run without the first
            path.unlink(missing_ok=True)
        for path in self.points_folder.glob("*.points"):
            path.unlink()
        for folder in (self.points_folder, self.folder):
            with suppress(OSError):
                folder.rmdir()


def read_document(unfinished: UnfinishedRun) -> dict[str, Any]:
    """Return what ``run.json`` says, or say that there is nothing to resume."""
    out = unfinished.out
    try:
        return unfinished.document()
    except FileNotFoundError:
        if (out / "report.json").exists():
            raise RunError(f"{out} holds a run that is finished: there is nothing to resume", 2) from None
        what = f"{out} holds no unfinished run" if out.is_dir() else f"there is no folder {out}"
        raise RunError(f"{what}; give the folder that nacre reconstruct wrote to", 2) from None
