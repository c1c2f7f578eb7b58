"""Files that other files name."""

from __future__ import annotations

import errno
from pathlib import Path, PurePosixPath, PureWindowsPath

from nacre.errors import FileFormatError
from nacre.io.raw import excerpt

_LONGEST_NAME = 1000


def inside(folder: Path, name: str, listing: Path, line: int) -> Path:
    """
    Return the file that a line of another one names, which must be in its folder.

    Symbolic links in the folder are followed: they are the user's own.
    """
    if len(name) > _LONGEST_NAME:
        raise FileFormatError(listing, f"refused: a name of {len(name)} letters", line=line)
    place = PurePosixPath(name.replace("\\", "/"))
    if place.is_absolute() or ".." in place.parts or "\0" in name or PureWindowsPath(name).drive:
        reason = f"refused: the name {excerpt(name.encode())} leads outside its folder"
        raise FileFormatError(listing, reason, line=line)
    try:
        (folder / name).is_file()
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        raise FileFormatError(listing, f"refused: a name of {len(name)} letters", line=line) from None
    return folder / name
