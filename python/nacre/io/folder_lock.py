"""A folder that one process at a time writes to."""

from __future__ import annotations

import os
import sys


def lock_folder(path: str | os.PathLike[str]) -> int | None:
    """
    Hold a folder until the descriptor that is returned is closed or the process ends, however it does.

    Parameters
    ----------
    path : path-like
        The folder; nothing is written to it.

    Returns
    -------
    int or None
        The descriptor; None where the system or the disk has no such locks: then nothing is held.

    Raises
    ------
    BlockingIOError
        Another process holds it.
    OSError
        It cannot be opened.
    """
    if sys.platform == "win32":
        return None
    import fcntl

    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise
    except OSError:
        os.close(descriptor)
        return None
    return descriptor
