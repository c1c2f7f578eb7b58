"""The programs that measure reliability, small: they run, and their limits hold."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import nacre

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="they read /proc"),
]


def run(program: str, *words: str) -> str:
    """Run one of them, with this nacre."""
    path = os.pathsep.join([str(Path(str(nacre.__file__)).parents[1]), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / program), *words],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.weekly
def test_whole_reconstructions_have_the_same_bits() -> None:
    cases = ("--only", "room", "--only", "object", "--frames", "40")
    said = run("determinism.py", "--threads", "1,3", "--repeats", "1", *cases)
    results = [line for line in said.splitlines() if line.startswith("  ") and "SHA-256" not in line]
    assert len(results) == 2 * 12
    assert "1 loops" in said
    assert "LOST" in said


def test_the_determinism_program_tells_a_difference() -> None:
    """A program that finds everything the same would be no use."""
    code = """
    import sys, numpy as np
    sys.path.insert(0, sys.argv[1])
    from determinism import Result
    points = np.ones((5, 3), np.float32)
    moved = points.copy()
    moved[4, 2] = np.nextafter(moved[4, 2], np.float32(2))
    a, b = (Result({"points": p, "poses": np.eye(4)[None]}, "{}") for p in (points, moved))
    assert a.sha256 != b.sha256 and a.sha256 != Result(a.arrays, "{1}").sha256
    assert "points up to 1.2e-07 m" in a.difference(b)
    """
    command = [sys.executable, "-c", "\n".join(line.strip() for line in code.splitlines()), str(BENCHMARKS)]
    subprocess.run(command, check=True)


@pytest.mark.parametrize("scene", ["static", pytest.param("turning", marks=pytest.mark.weekly)])
def test_three_hundred_frames(scene: str) -> None:
    """Drift and cap, and memory where no new surface comes into view; frame times are for longer runs."""
    left_out = ["--not", "p99_ratio", *(["--not", "memory_growth"] if scene == "turning" else [])]
    said = run("soak.py", "--scene", scene, "--frames", "300", *left_out)
    assert f"{scene}: every limit holds" in said
    assert "tracked=300" in said


def test_a_walk_through_a_flat() -> None:
    """The camera is followed to millimetres, and a model that is full keeps its size and becomes coarser."""
    parts = {}
    for most in (1_000_000, 30_000):
        said = run("flat.py", *f"--frames 1250 --laps 1 --only 60 --part 30 --max-points {most}".split())
        numbers = [[float(n) for n in re.findall(r"[\d.]+", line)] for line in said.splitlines()]
        assert all(line[1:3] == [30, 30] for line in numbers[:2])  # tracked
        assert numbers[-1][1] < 5  # mm, the worst
        parts[most] = dict(zip(("points", "spacing"), numbers[1][5:7], strict=True))
    free, full = parts.values()
    assert free["points"] > 30_000 >= full["points"]
    assert full["spacing"] > free["spacing"]


def test_a_missed_limit_is_an_error() -> None:
    with pytest.raises(AssertionError, match="static: drift_mm"):
        run("soak.py", "--scene", "static", "--frames", "60", "--not", "p99_ratio", "--sigma", "0.03")


def test_the_load_program_tells_a_slower_model_from_a_slower_machine() -> None:
    code = """
    import sys, time
    sys.path.insert(0, sys.argv[1])
    import nacre
    from soak import soak
    real = nacre.Model.add_frame
    calls = 0
    def slower(model, depth, color):
        global calls
        calls += 1
        report = real(model, depth, color)
        end = time.process_time() + 0.0005 * (report.index if sys.argv[2] == "model" else calls)
        while time.process_time() < end:
            pass
        return report
    nacre.Model.add_frame = slower
    outcome = soak("static", 60, 64, 4000, 0.002)
    missed = [words.split()[0] for words in outcome.missed([])]
    assert ("p99_ratio" in missed) == (sys.argv[2] == "model"), outcome
    """
    program = "\n".join(line.removeprefix("    ") for line in code.splitlines())
    for cause in ("model", "machine"):
        subprocess.run([sys.executable, "-c", program, str(BENCHMARKS), cause], check=True)


def test_every_hostile_point_file_is_told() -> None:
    files, *told = map(int, run("damaged_points.py", "--only", "nacre").split()[-7:])
    assert told == [files, 0, 0, 0, 0, 0]


def test_models_come_and_go_and_others_live_beside_them() -> None:
    said = run("life.py", "--cycles", "60", "--seconds", "2", "--busy")
    assert "a child process gets its parent's bits: True" in said


def test_thirty_two_bytes_that_a_model_leaves_are_found() -> None:
    """The least that the allocator gives."""
    code = """
    import sys
    sys.path.insert(0, sys.argv[1])
    from life import MOST_LEFT, growth_in_fresh_process
    leak = "grown = life.grown; life.grown = lambda scene: (grown(scene), life.ctypes.CDLL(None).malloc(1))"
    left, _ = growth_in_fresh_process(60, leak)
    assert left > MOST_LEFT, left
    """
    command = [sys.executable, "-c", "\n".join(line.strip() for line in code.splitlines()), str(BENCHMARKS)]
    subprocess.run(command, check=True)
