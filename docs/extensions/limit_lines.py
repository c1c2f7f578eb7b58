"""The lines of the ``limits.hpp`` of each folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

SOURCES = Path(__file__).resolve().parents[2] / "cpp" / "src"
KINDS = ("derived", "budget", "tuned")
LINE = re.compile(r"(?:inline )?constexpr [\w:]+ (\w+) = (.+);  // \[(.+?)\] (\w+): (.+); (.+)")


class Number(NamedTuple):
    """One line of a ``limits.hpp``."""

    name: str
    value: str
    unit: str
    kind: str
    meaning: str
    guard: str


def numbers_of(header: Path) -> list[Number]:
    """Return the numbers of a header; a ValueError names a line that is not as it should be."""
    found = []
    for line in header.read_text(encoding="utf-8").splitlines():
        match = LINE.fullmatch(line)
        if match and match[4] in KINDS:
            found.append(Number(*match.groups()))
        elif "constexpr" in line:
            raise ValueError(f"{header}: not '// [unit] kind: meaning; guard' after a number: {line}")
    return found
