"""Warnings: what a caller may want to know of a file that was read or written."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Sequence
from pathlib import Path

from nacre._internal.guided import listing
from nacre.errors import printable


def warn(message: str) -> None:
    """Warn at the line that called nacre."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "nacre":
        frame, level = frame.f_back, level + 1
    warnings.warn(printable(message), stacklevel=level)


def warn_of_loss(path: str | os.PathLike[str], fields: Sequence[str]) -> None:
    """Warn of fields that are not in a file that is written, where there are some."""
    if fields:
        suffix = Path(path).suffix.lower()
        warn(f"{os.fspath(path)}: {suffix} files have no place for {listing(fields)}")
