"""
What a long-lived program sees of nacre: models that come and go, forks, other thread pools.

    python benchmarks/life.py                 # 1000 cycles, ten seconds of ticks
    python benchmarks/life.py --cycles 60 --seconds 2 --busy    # as the tests run it

Prints a line for each and ends with 1 where a promise does not hold.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import hashlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from simulated import Scene
from soak import memory

import nacre

MOST_LEFT = 1000  # [bytes]: allocated, by all the models together
MOST_GROWTH = 1e6  # [bytes]: resident
FOLDERS = [str(Path(__file__).resolve().parent), str(Path(str(nacre.__file__)).parents[1])]
MOST_LOST = 0.05  # of a thread's ticks


def grown(scene: Scene, frames: int = 3) -> nacre.Model:
    """Return a small model."""
    model = nacre.Model(scene.camera, num_threads=2)
    for index in range(frames):
        model.add_frame(scene.depth(index), scene.color(index))
    return model


def bits(model: nacre.Model) -> str:
    """Return the SHA-256 of a model's points and poses."""
    return hashlib.sha256(
        model.points.tobytes() + model.normals.tobytes() + model.poses.tobytes()
    ).hexdigest()


# Then glibc counts Python's objects too, and nothing as in use that a thread keeps for its next request.
ALLOCATOR = {"PYTHONMALLOC": "malloc", "GLIBC_TUNABLES": "glibc.malloc.tcache_count=0"}


class Mallinfo(ctypes.Structure):
    """What glibc says of its memory."""

    _fields_: ClassVar = [
        (name, ctypes.c_int)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


def in_use_and_resident() -> npt.NDArray[np.int64]:
    """Return the bytes that are allocated, and those that are resident; what is free is given back."""
    # CPython remembers the attributes that were last looked up, 4096 at most, and with each a string.
    clear = "_clear_internal_caches" if hasattr(sys, "_clear_internal_caches") else "_clear_type_cache"
    getattr(sys, clear)()
    gc.collect()
    libc = ctypes.CDLL(None)
    libc.mallinfo.restype = Mallinfo
    libc.malloc_trim(0)
    found = libc.mallinfo()
    return np.array([found.uordblks + found.hblkhd, memory()])


def growth_of_cycles(cycles: int) -> list[int]:
    """Make models and drop them; return what `in_use_and_resident` grow by from a tenth of the cycles on."""
    scene = Scene("static", 96)
    begin = np.zeros(2, np.int64)
    for cycle in range(cycles):
        grown(scene)
        nacre.align(np.eye(3), np.eye(3))
        if cycle + 1 == max(10, cycles // 10):
            begin = in_use_and_resident()
    growth: list[int] = (in_use_and_resident() - begin).tolist()
    return growth


def growth_in_fresh_process(cycles: int, before: str = "") -> list[int]:
    """Return `growth_of_cycles` under `ALLOCATOR`, in an interpreter that runs a line before it."""
    program = f"import sys; sys.path[:0] = {FOLDERS!r}\nimport life\n{before}\n"
    program += f"print(*life.growth_of_cycles({cycles}))"
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=os.environ | ALLOCATOR, stdout=subprocess.PIPE, text=True, check=True)
    return [int(word) for word in done.stdout.split()]


def ticks_per_second(seconds: float, work: Callable[[], Any]) -> float:
    """Return how often a thread wakes up that sleeps for 5 ms at a time, while this one works."""
    ticks = 0
    ended = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not ended.is_set():
            time.sleep(0.005)
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.perf_counter()
    while time.perf_counter() - begin < seconds:
        work()
    ended.set()
    thread.join()
    return ticks / (time.perf_counter() - begin)


def lost_ticks(seconds: float) -> float:
    """
    Return the part of its ticks that a thread loses while frames are added: in turns, the median of nine.

    The other turns are as busy, but without Python's lock: a hash of a large array.
    """
    scene = Scene("static", 640)
    large = bytes(2**24)
    depths = [scene.depth(index) for index in range(8)]
    model = nacre.Model(scene.camera, num_threads=1)
    frames = iter(range(10**9))
    lost = []
    for _ in range(9):
        free = ticks_per_second(seconds / 18, lambda: hashlib.sha256(large))
        busy = ticks_per_second(seconds / 18, lambda: model.add_frame(depths[next(frames) % 8]))
        lost.append(1 - busy / free)
    return float(np.median(lost))


# In a fresh interpreter: before and after, in the same process, each has to work.
BESIDE = """
import sys
sys.path[:0] = {path!r}
import {first}
import {second}
import numpy as np
import nacre
def other():
    {work}
from life import bits, grown
from simulated import Scene
scene = Scene("static", 96)
other(); first = bits(grown(scene)); other(); assert bits(grown(scene)) == first
print(first)
"""
POOLS = {
    "numpy.linalg": "np.random.default_rng(0).random((300, 300)) @ np.eye(300)",
    "scipy.spatial": "scipy.spatial.cKDTree(np.random.rand(2000, 3)).query(np.eye(3), workers=2)",
    "torch": "torch.rand(300, 300) @ torch.rand(300, 300)",
    "open3d": "open3d.geometry.PointCloud(open3d.utility.Vector3dVector(np.eye(3))).estimate_normals()",
    "cv2": "cv2.GaussianBlur(np.zeros((400, 400), np.float32), (9, 9), 2)",
}


def beside(library: str) -> str:
    """Say whether a library with threads of its own works beside nacre, imported before or after."""
    said = set()
    for first, second in ((library, "nacre"), ("nacre", library)):
        program = BESIDE.format(path=FOLDERS, first=first, second=second, work=POOLS[library])
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        if "ModuleNotFoundError" in done.stderr:
            return "not installed"
        said.add(done.stdout.split()[-1] if done.returncode == 0 else f"FAILED: {done.stderr[-300:]}")
    if any(text.startswith("FAILED") for text in said):
        return "; ".join(sorted(said))
    return "same bits in either order" if len(said) == 1 else "FAILED: other bits in the other order"


FORKED = """
import os, sys, warnings
sys.path[:0] = {path!r}
warnings.simplefilter("ignore")  # newer Pythons warn of fork with threads
from life import bits, grown
from simulated import Scene
scene = Scene("static", 96)
model = grown(scene)
child = os.fork()
model.add_frame(scene.depth(3))
if child == 0:
    os.write(1, bits(model).encode() + b" ")
    os._exit(0)
os.waitpid(child, 0)
print(bits(model))
"""


def goes_on_after_fork() -> bool:
    """Return whether a child process gets the same bits out of a model that its parent has begun."""
    command = [sys.executable, "-c", FORKED.format(path=FOLDERS)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    child, parent = done.stdout.split()
    return child == parent


def main(words: list[str] | None = None) -> int:
    """Measure all of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cycles", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=10.0, help="of the ticking thread")
    parser.add_argument(
        "--busy", action="store_true", help="the machine is: print the ticks, and demand nothing"
    )
    options = parser.parse_args(words)
    holds = []
    if hasattr(os, "fork"):
        holds.append(goes_on_after_fork())
        print(f"a child process gets its parent's bits: {holds[-1]}", flush=True)
    for library in POOLS:
        said = beside(library)
        holds.append(not said.startswith("FAILED"))
        print(f"beside {library}: {said}", flush=True)
    if hasattr(ctypes.CDLL(None), "mallinfo"):  # glibc
        left, growth = growth_in_fresh_process(options.cycles)
        holds.append(left < MOST_LEFT and growth < MOST_GROWTH)
        said = f"{left} bytes more are allocated, {growth / 1e3:.0f} kB more are resident"
        print(f"{options.cycles} models made and dropped: {said}", flush=True)
    lost = lost_ticks(options.seconds)
    holds.append(lost < MOST_LOST or options.busy)
    print(f"a thread beside add_frame loses {100 * lost:.1f} % of its ticks")
    return 0 if all(holds) else 1


if __name__ == "__main__":
    sys.exit(main())
