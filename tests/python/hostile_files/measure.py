"""What reading a file costs: time, memory, and whether it works under a limit of memory."""

from __future__ import annotations

import ctypes
import gc
import json
import logging
import os
import resource
import sys
import tempfile
import time
import warnings
from pathlib import Path

_trim = getattr(ctypes.CDLL(None), "malloc_trim", lambda keep: None)
MEGABYTE = 1 << 20
MOST_RATIO = 4


def allowed(num_bytes: int) -> int:
    """Return how much memory may be taken for a file of a size."""
    return MOST_RATIO * num_bytes + MEGABYTE


def status(key: str) -> int:
    """Return a figure of this process in bytes, such as VmRSS."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))
    return 1024 * int(line.split()[1])


def cost(read, path: Path) -> tuple[str, float, int]:
    """Return what came of reading a file, the processor time [s], and the memory taken at most [bytes]."""
    gc.collect()
    _trim(0)  # what was freed is given back, so that it counts when it is taken again
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = status("VmRSS")
    start = time.process_time()
    said = outcome(read, path)
    return said, time.process_time() - start, max(status("VmHWM") - before, 0)


def outcome(read, path: Path) -> str:
    """Return what came of reading a file, in words."""
    import nacre

    try:
        read(path)
    except nacre.FileFormatError as error:
        return f"error: {error}"
    except Exception as error:
        return type(error).__name__
    return "read"


def limited(read, path: Path, num_bytes: int) -> str:
    """Return what comes of reading a file where no more memory than is allowed can be had."""
    gc.collect()
    before = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (status("VmData") + allowed(num_bytes), before[1]))
    try:
        return outcome(read, path)
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def large() -> None:
    """Measure large files that are as they should be; print a line of JSON for each."""
    import numpy as np

    import nacre
    from hostile_files.case import READERS
    from hostile_files.ply import ply, text, vertices

    n, normal = 100_000, np.random.default_rng(0).normal
    points = normal(size=(n, 3)).astype(np.float32)
    poses = np.tile(np.eye(4), (n // 5, 1, 1))
    poses[:, :3, 3] = normal(size=(n // 5, 3))
    lists = f"{vertices(2)}\nelement face {n}\nproperty list uchar uchar i"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for suffix in ("ply", "pcd"):
            for form in ("binary", "text"):
                path = folder / f"{form}.{suffix}"
                nacre.write_points(path, points, normals=points, binary=form == "binary")
        nacre.write_trajectory(folder / "trajectory.txt", np.arange(n // 5), poses)
        (folder / "digits.ply").write_bytes(text(b"0 0 0\n" * n, vertices(n)))
        (folder / "digits64.ply").write_bytes(text(b"0 0 0\n" * n, vertices(n).replace("float", "double")))
        (folder / "lists.ply").write_bytes(ply(bytes(24) + b"\1\0" + bytes(n - 1), lists))
        (folder / "digits.txt").write_bytes(b"0 0 0 0 0 0 0 1\n" * n)
        matrix = b"1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
        (folder / "digits.log").write_bytes((b"0 0 0\n" + matrix) * (n // 5))
        readers = {".txt": "trajectory", ".log": "trajectory"}
        for path in sorted(folder.iterdir()):
            read = READERS[readers.get(path.suffix, "points")]
            found = read(path)
            arrays = [*vars(found).values(), *vars(found).get("attributes", {}).values()]
            held = sum(a.nbytes for a in arrays if isinstance(a, np.ndarray))
            del found, arrays
            _, seconds, peak = cost(read, path)
            row = {
                "name": path.name,
                "size": path.stat().st_size,
                "held": held,
                "seconds": seconds,
                "peak": peak,
            }
            print(json.dumps(row), flush=True)


def main() -> None:
    """Measure every hostile file in this process; print a line of JSON for each."""
    from importlib.util import find_spec

    from hostile_files import CASES, opened, write
    from hostile_files.valid import VALID

    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        for case in (*VALID.values(), *CASES.values()):  # whatever is imported or kept is so by then
            if find_spec(case.needs) is not None:
                outcome(lambda path, case=case: opened(case, path), write(case, Path(folder) / "warm"))
        gc.collect()
        gc.freeze()  # so that collecting again is quick
        for name, case in CASES.items():
            if find_spec(case.needs) is None:
                continue
            path = write(case, Path(folder))
            size = sum(map(len, case.files.values()))
            said, seconds, peak = cost(lambda path, case=case: opened(case, path), path)
            under_limit = limited(lambda path, case=case: opened(case, path), path, size)
            row = {
                "name": name,
                "size": size,
                "said": said,
                "seconds": seconds,
                "peak": peak,
                "limited": under_limit,
            }
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    large() if "--large" in sys.argv else main()
