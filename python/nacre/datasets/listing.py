"""What lies in a folder, in name order, and which files belong together."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from nacre.errors import FileFormatError


def natural_key(path: Path) -> list[tuple[int, str]]:
    """Sort key under which ``2.png`` comes before ``10.png``."""
    return [
        (int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name) if part
    ]


def files(folder: Path, suffixes: Iterable[str]) -> list[Path]:
    """Return the folder's visible files with one of the suffixes, in name order; [] without a folder."""
    if not folder.is_dir():
        return []
    wanted = {suffix.lower() for suffix in suffixes}
    found = (
        p
        for p in folder.iterdir()
        if p.suffix.lower() in wanted and not p.name.startswith(".") and p.is_file()
    )
    return sorted(found, key=natural_key)


def pair(depth: list[Path], color: list[Path]) -> list[Path | None]:
    """
    Return for each depth image its colour image, or None.

    They belong together when their stems are equal, or else when the first number in their names is.
    """
    for key in (lambda path: path.stem, _number):
        by_key = {key(path): path for path in color}
        keys = [key(path) for path in depth]
        unique = len(by_key) == len(color) and len(set(keys)) == len(keys)
        if unique and None not in by_key and any(k in by_key for k in keys):
            return [by_key.get(k) for k in keys]
    return [None] * len(depth)


def require_order(path: Path, line: int, time: float, before: float | None) -> None:
    """Raise where a time of a list goes back."""
    if before is not None and time < before:
        reason = f"the time {time!r} does not come after {before!r}: sort the list by its times"
        raise FileFormatError(path, reason, line=line)


def describe(folder: Path) -> str:
    """Say in a few words what a folder holds, for error messages."""
    entries = sorted((p for p in folder.iterdir() if not p.name.startswith(".")), key=natural_key)
    folders = [f"{p.name}/ ({sum(1 for _ in p.iterdir())} entries)" for p in entries if p.is_dir()]
    plain = [p for p in entries if not p.is_dir()]
    names = [p.name for p in plain] if len(plain) <= 6 else [f"{len(plain)} files like {plain[0].name}"]
    shown = folders[:6] + ([f"{len(folders) - 6} more folders"] if len(folders) > 6 else []) + names
    return ", ".join(shown) or "nothing"


def _number(path: Path) -> int | None:
    match = re.search(r"\d+", path.stem)
    return int(match.group()) if match else None
