"""Long calls can be stopped: by Ctrl-C at any moment, and by their progress callbacks."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre

SURFACE = np.random.default_rng(0).random((300_000, 3)) * (1, 1, 0)
BODY = np.random.default_rng(0).normal(size=(3000, 3)) * (1.0, 0.6, 0.3)

# Each takes many seconds.
LONG: dict[str, Callable[[], object]] = {
    "consolidate": lambda: nacre.consolidate(SURFACE, radius=0.5, num_points=100_000),
    "align_global": lambda: nacre.align_global(
        BODY, BODY[::-1] + 5, num_rotations=10**6, max_samples=3000, coarse_samples=3000, num_candidates=10**6
    ),
    "normals": lambda: nacre.estimate_normals(SURFACE, k=300),
    "normals of many": lambda: nacre.estimate_normals(SURFACE, k=30_000),
    "neighbors": lambda: nacre.KdTree(SURFACE).query(SURFACE[:10_000], k=10_000),
}


@pytest.fixture(autouse=True)
def _ctrl_c_counts() -> Iterator[None]:
    """Processes that a shell starts in the background ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="no signals of this kind")
@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_ends_a_call_within_a_second(name: str) -> None:
    pressed = []

    def press() -> None:
        time.sleep(0.3)
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    button = threading.Thread(target=press)
    button.start()
    with pytest.raises(KeyboardInterrupt):
        LONG[name]()
    reacted = time.monotonic()
    button.join()
    assert reacted - pressed[0] < 2.0  # asked ten times a second; a busy machine adds its own


def test_a_signal_whose_handler_raises_nothing_changes_nothing() -> None:
    points = SURFACE[:50_000]
    expected = nacre.consolidate(points, radius=0.05, num_points=20_000)
    heard = []
    before = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    button = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT))
    try:
        button.start()
        result = nacre.consolidate(points, radius=0.05, num_points=20_000)
        button.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [signal.SIGINT]
    assert np.array_equal(result.points, expected.points)


def test_a_frame_is_always_folded_in_as_a_whole() -> None:
    """Stopped between tracking and fusion, a model would be neither the one nor the other."""
    program = """
        import os, signal, threading, time
        import nacre
        mesh = nacre.built_in_object()
        camera = nacre.default_camera(mesh, "pinhole")
        poses = nacre.turntable_poses(mesh, 4, 0.3, camera=camera)
        images = [mesh.simulate_depth(camera, pose, noise=0.001) for pose in poses]
        whole, model = nacre.Model(camera), nacre.Model(camera)
        counts = [whole.add_frame(image).num_points for image in images]
        def press():
            for _ in range(100):
                time.sleep(0.005)
                os.kill(os.getpid(), signal.SIGINT)
        button = threading.Thread(target=press, daemon=True)
        num_heard = 0
        try:
            button.start()
        except KeyboardInterrupt:
            num_heard += 1
        while len(model.frames) < 4:
            try:
                model.add_frame(images[len(model.frames)])
            except KeyboardInterrupt:
                num_heard += 1
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print(num_heard > 0, [report.num_points for report in model.frames] == counts)
    """
    code = textwrap.dedent(program)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout.split() == ["True", "True"], done.stderr


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no signals of this kind")
def test_the_handler_of_a_signal_may_use_the_model(tmp_path: Path) -> None:
    """It comes between the steps of whatever call is going on, and waiting for that one would be for ever."""
    program = f"""
        import signal
        import nacre
        mesh = nacre.built_in_object()
        camera = nacre.default_camera(mesh, "pinhole")
        image = mesh.simulate_depth(camera, nacre.turntable_poses(mesh, 1, camera=camera)[0])
        model, saved = nacre.Model(camera), []
        def save(number, frame):
            model.save({str(tmp_path / "model")!r})
            saved.append((len(model.frames), len(model.points)))
        signal.signal(signal.SIGALRM, save)
        signal.setitimer(signal.ITIMER_REAL, 0.1, 0.1)
        while len(saved) < 10:
            model.add_frame(image)
        signal.setitimer(signal.ITIMER_REAL, 0)
        model = nacre.Model.load({str(tmp_path / "model")!r})
        print((len(model.frames), len(model.points)) == saved[-1])
    """
    code = textwrap.dedent(program)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout == "True\n", done.stderr


class TestConsolidate:
    def test_progress_is_told_of_each_iteration_and_changes_no_bit(self) -> None:
        told = []
        points = SURFACE[:5000]
        result = nacre.consolidate(points, radius=0.1, iterations=4, progress=lambda *now: told.append(now))
        assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
        assert not result.cancelled
        assert np.array_equal(result.points, nacre.consolidate(points, radius=0.1, iterations=4).points)

    @pytest.mark.parametrize("way", ["return False", "raise Cancelled"])
    def test_what_was_reached_by_then_is_the_result(self, way: str) -> None:
        def progress(done: int, total: int) -> bool:
            if done == 2 and way.startswith("raise"):
                raise nacre.Cancelled
            return done < 2

        points = SURFACE[:5000]
        result = nacre.consolidate(points, radius=0.1, attributes={"x": points[:, 0]}, progress=progress)
        assert (result.cancelled, result.iterations) == (True, 2)
        assert "cancelled after 2 iterations" in repr(result)
        assert np.array_equal(result.points, nacre.consolidate(points, radius=0.1, iterations=2).points)
        assert np.allclose(result.attributes["x"], points[result.sources, 0], atol=1e-6)

    def test_other_exceptions_come_out(self) -> None:
        def progress(done: int, total: int) -> None:
            raise ZeroDivisionError("mine")

        with pytest.raises(ZeroDivisionError, match="mine"):
            nacre.consolidate(SURFACE[:1000], progress=progress)

    def test_progress_must_be_a_function(self) -> None:
        with pytest.raises(TypeError, match="progress must be a function or None, got True"):
            nacre.consolidate(SURFACE[:1000], progress=True)  # type: ignore[arg-type]
