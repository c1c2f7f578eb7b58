"""JSON from anywhere: whatever is wrong with it becomes an error that names the file and the place."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from typing import Any

from nacre.errors import FileFormatError
from nacre.evaluation.result import plain
from nacre.io.raw import excerpt, read_file, text_of


def read_json(path: str | os.PathLike[str], most: int | None = None) -> Any:
    """
    Read a JSON file.

    Parameters
    ----------
    path : path-like
        The file.
    most : int, optional
        How many bytes it may have. What is parsed takes up to 25 times as much.

    Raises
    ------
    FileFormatError
        It is too large, no text, no JSON, nested too deep, or has a key twice in one object.
    OSError
        It cannot be read.
    """
    return parse_json(path, read_file(path, most))


def parse_json(path: str | os.PathLike[str], data: bytes) -> Any:
    """Return what the bytes of a JSON file say; ``path`` names it in errors, see :func:`read_json`."""
    text = text_of(path, data)
    try:
        return json.loads(text, object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise FileFormatError(path, f"not a JSON file: {error.msg}", line=error.lineno) from error
    except RecursionError:
        raise FileFormatError(path, "not a JSON file that can be read: it is nested too deep") from None
    except ValueError as error:  # two keys, or a number of more digits than Python reads
        raise FileFormatError(path, f"not a JSON file that can be read: {error}") from None


def to_json(figures: Mapping[str, Any]) -> str:
    """Return a JSON object; numbers that are not finite are null."""
    text = json.dumps(plain(figures), indent=2, allow_nan=False, default=str)
    # Lists of numbers on one line; a line break is never part of a string.
    return re.sub(r"\[\n\s+([^\[\]{}]*?)\n\s+\]", lambda m: "[" + re.sub(r"\n\s+", " ", m[1]) + "]", text)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for i, name in enumerate(names) if name in names[:i])
        raise ValueError(f"the key {excerpt(twice.encode(errors='backslashreplace'))} is there twice")
    return found
