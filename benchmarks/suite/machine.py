"""What it ran on: the machine, what it gives at most, versions, sizes."""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import platform
import resource
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from suite.contest import Workers
from suite.native import AbsentError, function

PACKAGES = {
    "nacre": "nacre",
    "small_gicp": "small_gicp",
    "scipy": "scipy.spatial",
    "pykdtree": "pykdtree.kdtree",
    "open3d": "open3d",
    "opencv-contrib-python-headless": "cv2",
}
NATIVE = ["cgal", "pcl", "flann", "nanoflann"]


def describe() -> dict[str, str]:
    """Return what readers must know of the machine."""
    info = _fields(Path("/proc/cpuinfo"))
    release = _fields(Path("/etc/os-release"), "=")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    compiler = _output("c++", "--version").splitlines()
    flags = info.get("flags", "").split()
    caches = sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*/size"))
    vectors = [name for name in ("avx2", "avx512f") if name in flags]
    return {
        "processor": f"{info.get('model name', platform.machine())} (family {info.get('cpu family', '?')}, "
        f"model {info.get('model', '?')}), {' '.join(vectors)}",
        "cores": f"{len(os.sched_getaffinity(0))}{', a virtual machine' if 'hypervisor' in flags else ''}",
        "last cache": caches[-1].read_text().strip() if caches else "?",
        "memory": f"{memory:.0f} GiB",
        "system": f"{release.get('PRETTY_NAME', '').strip(chr(34))}, Linux {platform.release()}",
        "compiler": compiler[0] if compiler else "none",
    }


def _fields(path: Path, separator: str = ":") -> dict[str, str]:
    lines = path.read_text().splitlines() if path.exists() else []
    pairs = [line.partition(separator) for line in lines]
    return {key.strip(): value.strip() for key, found, value in reversed(pairs) if found}


def _output(*command: str) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


class Others:
    """Measures the part of the processors' time that other processes take."""

    def __init__(self) -> None:
        self._start = self._now()

    def share(self) -> float:
        """Return the part since the start; workers that have ended count as ours."""
        busy, own, total = (now - then for now, then in zip(self._now(), self._start, strict=True))
        return max(0.0, busy - own) / total

    @staticmethod
    def _now() -> tuple[float, float, float]:
        line = Path("/proc/stat").read_text().splitlines()[0].split()[1:9]
        user, nice, system, idle, wait, *rest = (int(value) / os.sysconf("SC_CLK_TCK") for value in line)
        busy = user + nice + system + sum(rest)
        own = sum(
            usage.ru_utime + usage.ru_stime
            for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        )
        return busy, own, busy + idle + wait


def versions() -> dict[str, str]:
    """Return the versions of everything that takes part."""
    with Workers(1) as workers:
        found = workers.ask("versions", {"versions_of": [*PACKAGES, "numpy", *NATIVE]})
    return {"python": platform.python_version(), **found}


def limits(thread_counts: list[int]) -> dict[str, Any]:
    """Measure what the machine gives: bytes and operations a second, and the seconds of a dependent load."""
    try:
        triad = function("machine", "triad", ctypes.c_double)
        multiply_add = function("machine", "multiply_add", ctypes.c_double)
        latency = function("machine", "load_latency", ctypes.c_double)
    except (AbsentError, OSError):
        return {}
    return {
        "bandwidth": {str(threads): triad(threads) for threads in thread_counts},
        "operations": {str(threads): multiply_add(threads) for threads in thread_counts},
        "latency": {f"{mebibytes} MiB": latency(mebibytes << 20) for mebibytes in (1, 16, 512)},
    }


def packages(wheel: str) -> dict[str, dict[str, Any]]:
    """Return the installed size and the time of import of nacre and the Python peers."""
    found: dict[str, dict[str, Any]] = {}
    for name, module in {"numpy": "numpy", **PACKAGES}.items():
        try:
            files = importlib.metadata.distribution(name).files or []
        except importlib.metadata.PackageNotFoundError:
            continue
        paths = [Path(str(file.locate())) for file in files]
        size = sum(path.stat().st_size for path in paths if path.is_file())
        code = f"import time; start = time.perf_counter(); import {module}"
        code += "; print(time.perf_counter() - start)"
        times = [_output(sys.executable, "-c", code).splitlines() for _ in range(4)][1:]
        if all(times):
            seconds = statistics.median(float(lines[-1]) for lines in times)
            found[name] = {"installed": size, "import": seconds}
    if wheel and "nacre" in found:
        found["nacre"]["wheel"] = Path(wheel).stat().st_size
    return found
