"""What reading a file costs: time, memory, and whether it works under a limit of memory."""

from __future__ import annotations

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
    """Return what came of reading a file, the processor time [s] and the memory that it took at most [bytes]."""
    gc.collect()
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


def main() -> None:
    """Measure every hostile file in this process; print a line of JSON for each."""
    from importlib.util import find_spec

    from hostile import CASES, opened, write
    from hostile.valid import VALID

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
            row = {"name": name, "size": size, "said": said, "seconds": seconds, "peak": peak, "limited": under_limit}
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
