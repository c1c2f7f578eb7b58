"""``nacre doctor``: what a bug report needs to know."""

from __future__ import annotations

import os
import platform
import re
import sys
from pathlib import Path
from typing import Any

from nacre.cli.terminal import Json, Terminal

_VARIABLES = ("NACRE_SIMD", "OMP_NUM_THREADS")


def doctor(json: Json = False) -> None:
    """Tell what nacre runs on, which extras are installed, and whether the library works; for bug reports."""
    terminal = Terminal(json)
    import numpy as np

    import nacre

    figures: dict[str, Any] = {
        "nacre": nacre.__version__,
        "folder": str(Path(nacre.__file__).parent),
        "python": f"{platform.python_version()} ({sys.executable})",
        "numpy": np.__version__,
        "system": platform.platform(),
        "processor": processor(),
        "instruction_set": nacre.instruction_set(),
        "threads": nacre.default_threads(),
        "parallel_backend": nacre.parallel_backend(),
        "environment": {name: os.environ[name] for name in _VARIABLES if name in os.environ},
        "extras": extras(),
        "self_test": self_test(),
    }
    rows = [(name.replace("_", " "), str(figures[name])) for name in figures if name not in _NESTED]
    rows += [(name, value) for name, value in figures["environment"].items()]
    rows += [(f"extra {name}", told(name, packages)) for name, packages in figures["extras"].items()]
    terminal.answer(figures, [*rows, ("self test", figures["self_test"])])


_NESTED = ("environment", "extras", "self_test")


def extras() -> dict[str, dict[str, str | None]]:
    """Return, for each extra for users, its packages and their versions; None where one is missing."""
    from importlib import metadata

    found: dict[str, dict[str, str | None]] = {}
    try:
        requirements = metadata.requires("nacre") or []
    except metadata.PackageNotFoundError:
        return found
    for requirement in requirements:
        match = re.match(r"([\w.-]+).*extra\s*==\s*['\"](\w+)['\"]", requirement)
        if match is None or match[1].lower() == "nacre" or match[2] in ("all", "test"):
            continue
        if "python_version" in requirement and sys.version_info >= (3, 11):
            continue
        try:
            version: str | None = metadata.version(match[1])
        except metadata.PackageNotFoundError:
            version = None
        found.setdefault(match[2], {})[match[1]] = version
    return found


def told(extra: str, packages: dict[str, str | None]) -> str:
    """Return in words whether an extra is installed, and else how to."""
    missing = [name for name, version in packages.items() if version is None]
    if missing:
        return f'{", ".join(missing)} missing: pip install "nacre[{extra}]"'
    return ", ".join(f"{name} {version}" for name, version in packages.items())


def processor() -> str:
    """Return the processor's name, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())


def self_test() -> str:
    """Turn a wavy surface by a known motion, and see whether ``align`` finds it."""
    import numpy as np

    import nacre

    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 60), np.linspace(-0.1, 0.1, 60))
    points = np.stack([x, y, 0.02 * np.sin(40 * x) * np.cos(30 * y)], axis=-1).reshape(-1, 3)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(0.05), -np.sin(0.05)], [np.sin(0.05), np.cos(0.05)]]
    found = nacre.align(points, points @ turn[:3, :3].T).target_from_source
    error = float(np.abs(found - turn).max())
    return "passed" if error < 1e-3 else f"FAILED: align is off by {error:.3g}"
