"""Threads and instruction sets: what a process that uses nacre sees of them."""

import os
import platform
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nacre


def run_python(program: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A program of its own, since threads and instruction sets are chosen once in a process."""
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def points(n: int = 20000) -> np.ndarray:
    return np.random.default_rng(3).random((n, 3))


def test_packages_have_threads_of_their_own():
    assert nacre.parallel_backend() == "threads"


def test_threads_sleep_after_a_call():
    tree = nacre.KdTree(points())
    tree.query(points(), k=4, num_threads=8)
    time.sleep(0.01)
    before = time.process_time()
    time.sleep(0.2)
    assert time.process_time() - before < 0.02


def test_calls_from_several_python_threads_share_the_pool():
    tree = nacre.KdTree(points())
    expected = tree.query(points(), k=3)[1].tobytes()
    answers = []

    def ask() -> None:
        answers.extend(tree.query(points(), k=3, num_threads=3)[1].tobytes() for _ in range(5))

    threads = [threading.Thread(target=ask) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [expected] * 30


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_child_process_may_go_on_after_a_fork():
    done = run_python(
        """
        import os, warnings
        import numpy as np
        import nacre
        warnings.simplefilter("ignore")  # newer Pythons warn of fork with threads
        points = np.random.default_rng(0).random((20000, 3))
        tree = nacre.KdTree(points, num_threads=4)
        expected = tree.query(points, k=3, num_threads=4)[1]
        child = os.fork()
        same = np.array_equal(tree.query(points, k=3, num_threads=4)[1], expected)
        if child == 0:
            os._exit(0 if same else 1)
        _, status = os.waitpid(child, 0)
        print(same, os.waitstatus_to_exitcode(status))
        """
    )
    assert done.stdout.split() == ["True", "0"], done.stderr


def test_the_environment_names_the_number_of_threads():
    program = "import nacre; print(nacre.default_threads())"
    assert run_python(program, OMP_NUM_THREADS="3").stdout.split() == ["3"]
    assert nacre.default_threads() >= 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no processor affinity on this system")
def test_without_it_all_processors_that_the_process_may_use():
    program = """
    import os
    os.environ.pop("OMP_NUM_THREADS", None)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import nacre
    print(nacre.default_threads())
    """
    assert run_python(program).stdout.split() == ["1"]


def test_the_environment_names_the_instruction_set():
    program = "import nacre; print(nacre.instruction_set())"
    assert run_python(program, NACRE_SIMD="baseline").stdout.split() == ["baseline"]
    assert run_python(program, NACRE_SIMD="").stdout.split()[0] in ("baseline", "avx2", "avx512")


def test_an_unknown_instruction_set_is_an_error():
    done = run_python("import nacre; nacre.instruction_set()", NACRE_SIMD="mmx")
    assert done.returncode == 1
    assert "NACRE_SIMD must be baseline, avx2 or avx512, got mmx" in done.stderr


@pytest.mark.skipif(platform.machine() != "x86_64", reason="instruction sets are chosen on x86-64 only")
@pytest.mark.parametrize("instruction_set", ["baseline", "avx2", "avx512"])
def test_neighbours_and_normals_have_the_same_bits_on_every_instruction_set(instruction_set):
    program = """
        import hashlib, numpy as np, nacre
        digest = hashlib.sha256()
        rng = np.random.default_rng(11)
        surface = rng.normal(size=(6000, 3))
        surface /= np.linalg.norm(surface, axis=1, keepdims=True)
        surface += rng.normal(scale=0.003, size=surface.shape)
        lattice = rng.integers(0, 12, (3000, 3)) / 4
        clouds = (surface, surface.astype(np.float32), surface + 1e6, lattice, lattice.astype(np.float32))
        for points in clouds:
            tree = nacre.KdTree(points)
            for k in (1, 9, 16, 30, 70):
                for array in tree.query(points, k) + tree.query(points[::3] + 0.01, k, max_distance=0.1):
                    digest.update(array.tobytes())
            digest.update(nacre.estimate_normals(points).tobytes())
        print(digest.hexdigest())
    """
    forced = run_python(program, NACRE_SIMD=instruction_set)
    if "which this processor does not have" in forced.stderr:
        pytest.skip(f"no {instruction_set} here")
    assert forced.returncode == 0, forced.stderr
    assert forced.stdout == run_python(program).stdout


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="instruction sets are chosen on x86-64 only")
def test_vector_objects_define_only_their_own_names(library_build: Path, run: Callable[..., str]) -> None:
    """An inline function compiled for AVX must not take the place of its namesake on a processor without."""
    for level, isa in (("v3", "avx2"), ("v4", "avx512")):
        objects = list(library_build.rglob(f"*nacre_kernels_x86-64-{level}.dir/**/*.o"))
        assert objects
        for path in objects:
            for line in run("nm", "-C", "--defined-only", path).splitlines():
                kind, name = line.split(maxsplit=2)[1:]
                assert not kind.isupper() or name.startswith(f"nacre::simd::{isa}::"), (path.name, line)
