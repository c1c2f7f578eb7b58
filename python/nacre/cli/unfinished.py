"""``OUT/unfinished``: what ``nacre reconstruct --resume OUT`` needs, while a run is not finished."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.journal import Journal, read_journal
from nacre.cli.terminal import CommandError

if TYPE_CHECKING:
    from nacre.datasets import Sequence
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.frame_record import FrameRecord

_FORMAT = 1
_RARE = 50.0  # a checkpoint is written when so many times what the last one took has gone by: 2 % of the time
_LEAST_SECONDS = 5.0


@dataclass
class Stage:
    """
    Where a run is.

    Attributes
    ----------
    name : str
        "views": frames, until there are enough views to calibrate depth; "frames": the rest, or all of them.
        Lost frames are tried again when there are no more.
    views : list of (index, pose)
        That were chosen for the calibration; poses row by row.
    live : mapping or None
        What report.json says of a camera.
    """

    name: str = "frames"
    views: list[tuple[int, list[float]]] = field(default_factory=list)
    live: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, state: Any) -> Stage:
        """Return the stage that plain values tell."""
        from nacre._internal.arrays import as_count, as_vector

        name, live = state["name"], state["live"]
        if name not in ("views", "frames") or not (live is None or isinstance(live, dict)):
            raise ValueError(f"no stage is {name!r} with live {live!r}")
        views = [(as_count("view", i), as_vector("pose", pose, 16).tolist()) for i, pose in state["views"]]
        return cls(name, views, live)


class Unfinished:
    """
    The folder ``OUT/unfinished``: run.json (what was asked for), journal.txt and checkpoint.

    Parameters
    ----------
    out : Path
        The folder of the results.
    every : int, optional
        A checkpoint after so many frames; 0: only where the run is stopped. None: by time, see above.
    """

    def __init__(self, out: Path, every: int | None) -> None:
        self.out = out
        self.folder = out / "unfinished"
        self.stage = Stage()
        self._every = every
        self._journal: Journal | None = None
        self._lock: int | None = None
        self._num_since = 0
        self._next = time.monotonic() + _LEAST_SECONDS

    @property
    def checkpoint(self) -> Path:
        """The file of the newest checkpoint."""
        return self.folder / "checkpoint"

    def hold(self) -> None:
        """Keep other processes from writing to the folder of the results until this is closed."""
        from nacre.io.folder_lock import lock_folder

        try:
            self._lock = lock_folder(self.out)
        except BlockingIOError:
            raise CommandError(
                f"another nacre reconstruct is writing to {self.out}: wait until it has ended; "
                "a new run can go to another folder (-o)",
                2,
            ) from None

    def begin(self, done: Reconstruction, asked: Mapping[str, Any]) -> None:
        """Begin a new run; what was left of another goes."""
        from nacre.io.atomic import atomic_writer

        self._clear()
        self.folder.mkdir(exist_ok=True)
        self._journal = Journal(self.folder / "journal.txt")
        self.save(done)
        data = json.dumps({"format": _FORMAT, **asked}, indent=2, default=str)
        with atomic_writer(self.folder / "run.json") as stream:  # the last: from here on it can be resumed
            stream.write(data.encode() + b"\n")

    def resume(self, sequence: Sequence, compare: bool) -> Reconstruction:
        """Return the run as it was at the newest checkpoint; what is done again may be compared."""
        from nacre._internal.arrays import as_count
        from nacre.errors import FileFormatError
        from nacre.reconstruction import Reconstruction

        done, more = Reconstruction._load(self.checkpoint, sequence)
        try:
            self.stage = Stage.of(more["stage"])
            num_frames = as_count("num_journaled", more["num_journaled"])
        except (KeyError, TypeError, ValueError) as error:
            raise FileFormatError(self.checkpoint, f"it is no run of nacre reconstruct ({error})") from None
        # Views that a killed process had no time to keep are not there any more.
        self.stage.views = [view for view in self.stage.views if view[0] < len(sequence)]
        self._journal = Journal(self.folder / "journal.txt", num_frames, compare)
        return done

    def journaled_indices(self) -> list[int]:
        """Return which frames had been done, in order, each once."""
        return list(dict.fromkeys(entry[0] for entry in read_journal(self.folder / "journal.txt")[0]))

    def add(self, done: Reconstruction, record: FrameRecord) -> None:
        """Note a frame that is done; write a checkpoint where it is time."""
        assert self._journal is not None
        self._journal.add(record)
        self._num_since += 1
        due = time.monotonic() >= self._next if self._every is None else self._num_since == self._every
        if due:
            self.save(done)

    def save(self, done: Reconstruction) -> None:
        """Write a checkpoint."""
        assert self._journal is not None
        start = time.monotonic()
        self._journal.sync()
        stage = asdict(self.stage)
        done._save(self.checkpoint, stage=stage, num_journaled=self._journal.num_frames)
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
        from nacre.io.atomic import remove_leftovers

        remove_leftovers(self.folder)
        for name in ("run.json", "checkpoint", "journal.txt"):  # without the first it is no run any more
            (self.folder / name).unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()


def read_asked(out: Path) -> dict[str, Any]:
    """Return what ``OUT/unfinished/run.json`` says, or say that there is nothing to resume."""
    from nacre.errors import FileFormatError
    from nacre.io.json_files import read_json

    path = out / "unfinished" / "run.json"
    try:
        asked = read_json(path)
    except FileNotFoundError:
        if (out / "report.json").exists():
            raise CommandError(f"{out} holds a run that is finished: there is nothing to resume", 2) from None
        what = f"{out} holds no unfinished run" if out.is_dir() else f"there is no folder {out}"
        raise CommandError(f"{what}; give the folder that nacre reconstruct wrote to (its -o)", 2) from None
    if not isinstance(asked, dict) or asked.get("format") != _FORMAT:
        raise FileFormatError(
            path, "it was written by another version of nacre; run it again without --resume"
        )
    if not isinstance(asked.get("options"), dict):
        raise FileFormatError(path, "options must be an object: it is no run of nacre reconstruct")
    return asked


def describe_unfinished(out: Path) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Return what there is to tell of an unfinished run."""
    from nacre.cli.run_options import asked_before

    source = asked_before(read_asked(out), out / "unfinished" / "run.json")[0].source
    entries, _ = read_journal(out / "unfinished" / "journal.txt")
    figures = {"kind": "unfinished run", "path": os.fspath(out), "source": source, "num_done": len(entries)}
    lost = sum(entry[2] == "LOST" for entry in entries)
    return figures, [
        ("unfinished run", f"of {source}"),
        ("frames done", f"{len(entries)}" + f", {lost} lost" * bool(lost)),
        ("go on", f"nacre reconstruct --resume {out}"),
    ]
