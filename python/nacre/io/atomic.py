"""Files that are either complete or not there."""

from __future__ import annotations

import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO


@contextmanager
def atomic_writer(path: str | os.PathLike[str], *, named: bool = True) -> Iterator[BinaryIO]:
    """
    Open a file for writing that takes its name only when everything is written and on disk.

    When the block raises (a full disk, a killed process), a file that was there before is left as it was.

    Parameters
    ----------
    path : path-like
        The file to write; its folder must exist.
    named : bool
        Whether its name must be on disk, too, when this ends; for many small files that takes long.

    Yields
    ------
    BinaryIO
        The stream to write to.

    Raises
    ------
    OSError
        The file cannot be written; it names ``path``.
    """
    with atomic_path(path, named=named) as temporary, temporary.open("wb") as stream:
        yield stream


@contextmanager
def atomic_path(path: str | os.PathLike[str], *, named: bool = True) -> Iterator[Path]:
    """Do as :func:`atomic_writer` does for who needs a name to write to: yield that of an empty file."""
    target = Path(path)
    temporary: Path | None = None
    try:
        temporary = _new_file_beside(target)
        yield temporary
        with temporary.open("r+b") as stream:
            os.fsync(stream.fileno())
        temporary.replace(target)
        if named:
            _sync_folder(target.parent)
    except BaseException as error:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()
        if isinstance(error, OSError) and error.errno is not None and _is_about(error, target):
            raise OSError(error.errno, error.strerror, os.fspath(path)) from error
        raise


def _new_file_beside(target: Path) -> Path:
    """Create an empty file of a new name, with the permissions that the process gives its files."""
    while True:
        path = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
        with suppress(FileExistsError):
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            return path


def _is_about(error: OSError, target: Path) -> bool:
    name = error.filename
    return name is None or (isinstance(name, str) and Path(name).name.startswith(f".{target.name}."))


def _sync_folder(folder: Path) -> None:
    """Bring a new name to disk, where the system can."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EBADF):  # a file system that has none of it
            raise
    finally:
        os.close(descriptor)


def remove_leftovers(folder: Path) -> None:
    """Remove what :func:`atomic_writer` left in a folder when its process was killed."""
    with suppress(OSError):
        for path in list(folder.iterdir()):
            if re.fullmatch(r"\..+\.[0-9a-f]{8}\.tmp", path.name) and path.is_file():
                path.unlink(missing_ok=True)
