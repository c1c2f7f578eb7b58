"""The errors that a caller may want to catch by name."""

from __future__ import annotations

import difflib
import os
import reprlib
from collections.abc import Iterable
from pathlib import Path


class FileFormatError(ValueError):
    """
    A file that does not hold what its format or its own header promises.

    Parameters
    ----------
    path : path-like
        The file.
    reason : str
        What is wrong, in words.
    line : int, optional
        The line of a text, counted from 1, where it is wrong.
    offset : int, optional
        The byte, counted from 0, where it is wrong.

    Attributes
    ----------
    path, reason, line, offset
        As given; the message is made of them.
    """

    def __init__(
        self, path: str | os.PathLike[str], reason: str, *, line: int | None = None, offset: int | None = None
    ) -> None:
        super().__init__(path, reason)
        self.path = Path(path)
        self.reason = reason
        self.line = line
        self.offset = offset

    def __str__(self) -> str:
        place = f", line {self.line}" if self.line is not None else ""
        place += f", byte {self.offset}" if self.offset is not None else ""
        return printable(f"{self.path}{place}: {self.reason}")


class UnknownRecordingError(FileFormatError):
    """What was given is no recording, or not one without more options: not the files are wrong."""


class RunError(Exception):
    """
    What ends a run, in one line.

    Parameters
    ----------
    message : str
        What is wrong, and what to do.
    code : int
        The exit code of a program that ends by it; docs/conventions.md says what each means.
    """

    def __init__(self, message: str, code: int = 1) -> None:
        super().__init__(message)
        self.code = code


class CannotResumeError(RunError):
    """A run that cannot go on with what an earlier one left: the message says why."""


_repr = reprlib.Repr()
_repr.maxlist = _repr.maxdict = 10
_repr.maxstring = _repr.maxother = 60


class CameraError(RuntimeError):
    """A camera that is not there, or that gives no more frames; the message says what to do."""


def printable(text: str) -> str:
    """Return text that any UTF-8 writer takes: what is no text in a file's name is told by its number."""
    return text.encode(errors="backslashreplace").decode()


def shown(value: object) -> str:
    """Return a value from a file in a form and length that is fit for an error message."""
    return _repr.repr(value)


def meant(word: object, known: Iterable[str]) -> str:
    """Return " (did you mean 'x'?)" with the known word that is nearest to a wrong one, or nothing."""
    near = difflib.get_close_matches(str(word), list(known), 1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def explain(error: Exception) -> tuple[str, int]:
    """Return what to say about an error, and the exit code."""
    if isinstance(error, RunError):
        return str(error), error.code
    if isinstance(error, (CameraError, FileFormatError)):
        return str(error), 1
    if isinstance(error, OSError):
        name = f": {os.fspath(error.filename)}" if error.filename is not None else ""
        text = f"{error.strerror[:1].lower()}{error.strerror[1:]}{name}" if error.strerror else str(error)
        wrong_usage = (
            FileNotFoundError,
            FileExistsError,
            IsADirectoryError,
            NotADirectoryError,
            PermissionError,
        )
        return text, 2 if isinstance(error, wrong_usage) else 1
    if isinstance(error, MemoryError):
        return f"not enough memory: {error}".removesuffix(": "), 1
    if isinstance(error, (ImportError, ValueError, TypeError)):
        return str(error), 2
    return f"{type(error).__name__}: {error} (this should not happen; -v -v shows where)", 1
