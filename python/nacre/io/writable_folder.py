"""A folder for results, or why it cannot be one."""

from __future__ import annotations

import tempfile
from pathlib import Path

from nacre.errors import RunError


def writable_folder(path: Path) -> Path:
    """Make a folder for results, or say at once (:class:`nacre.errors.RunError`) that none can be there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        reason = (
            "it is a file" if isinstance(error, (FileExistsError, NotADirectoryError)) else error.strerror
        )
        raise RunError(f"cannot write to {path}: {reason}; give another folder", 2) from error
    return path
