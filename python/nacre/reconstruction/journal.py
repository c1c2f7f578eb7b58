"""What a run has done, frame by frame: a line each, appended when the frame is done."""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from typing import Any

from nacre.errors import FileFormatError
from nacre.run_data.frame_record import FrameRecord


class ChangedRunError(RuntimeError):
    """What is run again comes out otherwise than before the run was interrupted."""


def _line(entry: list[Any]) -> bytes:
    text = json.dumps(entry, separators=(",", ":")).encode()
    return b"%s %08x\n" % (text, zlib.crc32(text))


def read_journal(path: Path) -> tuple[list[list[Any]], int]:
    """Return the whole lines of a journal, up to the first that is not, and how many bytes they are."""
    entries: list[list[Any]] = []
    size = 0
    for line in path.read_bytes().splitlines(keepends=True) if path.exists() else []:
        text, _, checksum = line.rpartition(b" ")
        if checksum != b"%08x\n" % zlib.crc32(text):
            break
        entries.append(_entry(path, text, len(entries) + 1))
        size += len(line)
    return entries, size


def _entry(path: Path, text: bytes, line: int) -> list[Any]:
    try:
        entry = json.loads(text)
    except (ValueError, RecursionError):
        entry = None
    if not isinstance(entry, list) or len(entry) != 4 or type(entry[0]) is not int or entry[0] < 0:
        raise FileFormatError(path, "not a line of a run's journal, though its check sum fits", line=line)
    return entry


class Journal:
    """
    A line for each frame that is done: place in the recording, time, status, pose (row by row), checksum.

    A killed process loses the frame in flight at most. What a resumed run does again is compared with it.

    Parameters
    ----------
    path : Path
        The file.
    num_kept : int, optional
        Go on with a journal: so many of its frames need not be done again. None: begin a new one.
    compare : bool
        Whether the frames that are done again must come out as they did.
    """

    def __init__(self, path: Path, num_kept: int | None = None, compare: bool = True) -> None:
        self.path = path
        self._expected: list[list[Any]] = []
        self.num_frames = size = 0
        if num_kept is not None:
            entries, size = read_journal(path)
            if compare:
                self._expected = entries[num_kept:][::-1]
            else:
                size = sum(len(_line(entry)) for entry in entries[:num_kept])
            self.num_frames = min(num_kept, len(entries))  # of a damaged one, the lines before the damage
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
            os.ftruncate(self._descriptor, size)
        except OSError as error:
            raise OSError(error.errno, error.strerror, os.fspath(path)) from error

    def add(self, record: FrameRecord) -> None:
        """Note a frame, or compare it with what was noted before the run was interrupted."""
        pose = record.world_from_camera
        entry = [
            record.index,
            record.timestamp,
            record.status,
            None if pose is None else pose.ravel().tolist(),
        ]
        self.num_frames += 1
        if self._expected:
            before = self._expected.pop()
            if before != entry:
                raise ChangedRunError(
                    f"frame {record.index} is {record.status} at another place than before the run was "
                    "interrupted: the recording, nacre or the processor has changed"
                )
            return
        try:
            data = _line(entry)
            while data:
                data = data[os.write(self._descriptor, data) :]
        except OSError as error:
            raise OSError(error.errno, error.strerror, os.fspath(self.path)) from error

    def sync(self) -> None:
        """Bring it to disk."""
        try:
            os.fsync(self._descriptor)
        except OSError as error:
            raise OSError(error.errno, error.strerror, os.fspath(self.path)) from error

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)
