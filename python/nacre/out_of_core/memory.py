"""How much memory there is, and how much is needed."""

from __future__ import annotations

import os
import re

_UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
_SIZE = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([KMGT]?)(i?)B?\s*", re.IGNORECASE)

PER_PROCESS = 250_000_000
"""Bytes that a process has before it has read anything."""
SMALLEST = 2 * PER_PROCESS


def as_bytes(name: str, value: int | str | None) -> int:
    """Return a size in bytes: of a number, of a text such as 2GB or 512MiB; None: half of the machine's."""
    if value is None:
        return installed() // 2
    if isinstance(value, str):
        match = _SIZE.fullmatch(value)
        if match is None:
            raise ValueError(f"{name} must be a size such as 2GB or 512MB, got {value!r}")
        unit = _UNITS[match[2].upper()]
        factor = (
            unit
            if not match[3]
            else {1: 1, 10**3: 1 << 10, 10**6: 1 << 20, 10**9: 1 << 30}.get(unit, 1 << 40)
        )
        value = int(float(match[1]) * factor)
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{name} must be a number of bytes, or a text such as '2GB', got {value!r}")
    if value < SMALLEST:
        raise ValueError(f"{name} must be at least {SMALLEST // 10**6}MB, got {value} bytes")
    return value


def installed() -> int:
    """Return the machine's memory in bytes; 8 GB where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 8 * 10**9
