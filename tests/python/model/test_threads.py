"""Models in several threads."""

import threading
import time
from typing import Any

import numpy as np
from model_scenes import object_model, state

import nacre


def test_models_in_threads_are_as_if_alone() -> None:
    """Two of the same kind, and one of another."""
    kinds: list[dict[str, Any]] = [{}, {}, {"fusion_method": "wlop+", "max_points": 500}]
    alone = [state(object_model(4, **kind)) for kind in kinds]
    found: dict[int, Any] = {}

    def run(place: int) -> None:
        found[place] = state(object_model(4, **kinds[place]))

    threads = [threading.Thread(target=run, args=(place,)) for place in range(len(kinds))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[place] for place in range(len(kinds))] == alone


def test_other_threads_run_while_a_frame_is_added() -> None:
    """The GIL is released: a thread goes on counting during one long call."""
    camera = nacre.Camera(width=960, height=720, fx=800, fy=800, cx=479.5, cy=359.5)
    v, u = np.indices((720, 960), dtype=np.float32)
    depth = 1 + 0.05 * np.sin(u / 40) * np.cos(v / 30)
    model = nacre.Model(camera, num_threads=1)
    ticks: list[float] = []
    done = threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    while not ticks:
        time.sleep(0.001)
    most = 0
    for _ in range(10):
        begin = time.perf_counter()
        model.add_frame(depth)
        end = time.perf_counter()
        most = max(most, sum(begin < moment < end for moment in ticks))
        if most >= 3:
            break
    done.set()
    thread.join()
    assert most >= 3
