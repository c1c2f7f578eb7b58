"""Which recordings a batch has, and what each is called."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from nacre.datasets.detect import is_recording
from nacre.errors import FileFormatError
from nacre.io.raw import read_file, text_of

Sources = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]

# What a batch writes beside the folders of the recordings.
INDEX_PAGE, INDEX_FILE, THUMBNAILS = "index.html", "index.json", "thumbnails"


def find_recordings(sources: Sources) -> dict[str, Path]:
    """
    Return the recordings that sources name, by the names of their folders in the output.

    Parameters
    ----------
    sources : path-like, or iterable of path-like
        Recordings; folders of recordings; patterns such as ``scans/*``; ``@list.txt``, a text file with a
        path or a pattern a line, relative to its own folder, where lines that begin with ``#`` are left out.

    Returns
    -------
    dict of str to Path
        Absolute paths in the order given, each once. A recording is called as its folder, or as its file
        without the suffix; those that would share a name have those of their parents before it.

    Raises
    ------
    FileNotFoundError
        A pattern fits nothing, or there is no such list.
    FileFormatError
        A list is no text, or empty.
    TypeError, ValueError
        A source is no path; there is none.
    """
    given = [sources] if isinstance(sources, str | os.PathLike) else sources
    if not isinstance(given, Iterable):
        raise TypeError(f"sources must be paths of recordings, got {type(sources).__name__}")
    paths = dict.fromkeys(path for source in given for path in _paths_of(source))
    if not paths:
        raise ValueError("sources must name at least one recording, got none")
    return _named(list(paths))


def thumbnail_path(folder: Path) -> Path:
    """Return where the picture of the model is whose results are in a folder of the output."""
    return folder.parent / THUMBNAILS / f"{folder.name}.webp"


def _paths_of(source: str | os.PathLike[str]) -> Iterator[Path]:
    if not isinstance(source, str | os.PathLike):
        raise TypeError(f"sources must be paths of recordings, got {source!r} among them")
    text = os.fspath(source)
    if not text or "\0" in text:
        raise ValueError(f"sources must be paths of recordings, got {text!r} among them")
    if not text.startswith("@"):
        yield from _matching(text)
        return
    listing = Path(text[1:])
    lines = [line.strip() for line in text_of(listing, read_file(listing)).splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    if not lines:
        raise FileFormatError(listing, "it names no recording")
    for line in lines:
        yield from _matching(os.path.join(listing.parent, line))  # noqa: PTH118  a pattern is no path


def _matching(text: str) -> Iterator[Path]:
    if Path(text).exists() or not glob.has_magic(text):
        found = [text]
    else:
        found = sorted(glob.glob(text, recursive=True))  # noqa: PTH207  Path.glob takes no absolute pattern
        if not found:
            raise FileNotFoundError(f"there is nothing that fits {text}")
    for name in found:
        path = Path(os.path.abspath(name))  # noqa: PTH100  links keep their names
        inside = sorted(path.iterdir()) if path.is_dir() and not is_recording(path) else []
        yield from [part for part in inside if part.name[0] != "." and is_recording(part)] or [path]


def _named(paths: list[Path]) -> dict[str, Path]:
    """Call each path by as many of its last parts as tell it from the others."""
    stems = Counter((path.parent, _stem(path)) for path in paths)
    parts = [
        (*path.parent.parts[1:], _stem(path) if stems[path.parent, _stem(path)] == 1 else path.name)
        for path in paths
    ]
    lengths = [1] * len(paths)
    while True:
        names = ["-".join(part[-length:]) for part, length in zip(parts, lengths, strict=True)]
        taken = Counter(name.casefold() for name in [*names, INDEX_PAGE, INDEX_FILE, THUMBNAILS])
        shared = [i for i, name in enumerate(names) if taken[name.casefold()] > 1]
        longer = [i for i in shared if lengths[i] < len(parts[i])]
        if not longer:
            break
        for i in longer:
            lengths[i] += 1
    for number, i in enumerate(sorted(shared, key=lambda i: paths[i]), 1):
        names[i] += f"-{number}"
    return dict(zip(names, paths, strict=True))


def _stem(path: Path) -> str:
    return path.name if path.is_dir() else path.stem
