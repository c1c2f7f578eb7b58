"""Frames that come by themselves: the queue that drops them, playing in real time, keeping what came."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.datasets import GrowingRecording, LiveQueue, SequenceFrame, in_real_time

pytest.importorskip("PIL")
CAMERA = nacre.Camera(64, 48, 60, 60, 31.5, 23.5)


def started(queue: LiveQueue[int], condition: object = None) -> None:
    """Wait until a queue has fetched all that it can."""
    while queue._thread.is_alive():
        time.sleep(0.001)


class TestQueue:
    def test_who_is_fast_enough_gets_everything_in_order(self) -> None:
        with LiveQueue(range(5), size=5) as queue:
            assert list(queue) == [0, 1, 2, 3, 4]
        assert (queue.num_received, queue.num_dropped) == (5, 0)

    def test_the_oldest_are_dropped_and_counted(self) -> None:
        with LiveQueue(range(10), size=3) as queue:
            started(queue)
            assert list(queue) == [7, 8, 9]
        assert (queue.num_received, queue.num_dropped) == (10, 7)

    def test_a_fast_producer_is_never_held_up(self) -> None:
        with LiveQueue(range(1000), size=1) as queue:
            seen = []
            for item in queue:
                seen.append(item)
                time.sleep(0.001)
        assert seen == sorted(seen)
        assert seen[-1] == 999
        assert queue.num_dropped == 1000 - len(seen) > 0

    def test_the_producers_exception_comes_after_its_frames(self) -> None:
        def frames() -> Iterator[int]:
            yield 1
            raise nacre.CameraError("unplugged")

        with LiveQueue(frames()) as queue:
            assert next(queue) == 1
            with pytest.raises(nacre.CameraError, match="unplugged"):
                next(queue)
            with pytest.raises(StopIteration):
                next(queue)

    def test_silence_is_an_error(self) -> None:
        silence = threading.Event()
        with LiveQueue(iter(silence.wait, True), timeout=0.05) as queue:
            with pytest.raises(nacre.CameraError, match=r"no frame came for 0\.05 s"):
                next(queue)
            silence.set()

    def test_closing_ends_the_thread_and_the_producer(self) -> None:
        closed = threading.Event()

        def frames() -> Iterator[int]:
            try:
                while True:
                    yield 0
                    time.sleep(0.001)
            finally:
                closed.set()

        with LiveQueue(frames()) as queue:
            next(queue)
        assert closed.is_set()
        assert not queue._thread.is_alive()
        assert list(queue) == []

    def test_closing_wakes_who_waits(self) -> None:
        release = threading.Event()
        queue: LiveQueue[bool] = LiveQueue(iter(release.wait, True), timeout=60)
        got: list[bool] = []
        waiter = threading.Thread(target=lambda: got.extend(queue))
        waiter.start()
        threading.Timer(0.05, release.set).start()
        queue.close()
        waiter.join(5)
        assert not waiter.is_alive()
        assert got == []

    @pytest.mark.parametrize(("name", "value"), [("size", 0), ("timeout", 0), ("timeout", float("nan"))])
    def test_misuse(self, name: str, value: float) -> None:
        with pytest.raises(ValueError, match=f"{name} must be"):
            LiveQueue([], **{name: value})  # type: ignore[arg-type]


def frame(i: int, *, confident: bool = False) -> SequenceFrame:
    """Return a view of a wavy surface that approaches."""
    y, x = np.mgrid[0:48, 0:64]
    depth = (0.8 - 0.002 * i + 0.02 * np.sin(x / 5) * np.cos(y / 6)).astype(np.float32)
    depth = (np.rint(1000 * depth) / 1000).astype(np.float32)
    depth[0] = np.nan
    color = np.full((48, 64, 3), (200, 10, i), np.uint8)
    mask = x > 9 if confident else None
    return SequenceFrame(i, depth, CAMERA, 100 + i / 30, color, None, mask)


class TestGrowing:
    def test_what_was_added_can_be_read_again_at_once(self, tmp_path: Path) -> None:
        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        assert [growing.add(frame(i)) for i in range(4)] == [0, 1, 2, 3]
        assert len(growing) == 4
        for i in (3, 0, 2):
            np.testing.assert_allclose(growing[i].depth, frame(i).depth, atol=1e-6)
        growing.close()

    def test_it_is_a_plain_recording(self, tmp_path: Path) -> None:
        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        for i in range(3):
            growing.add(frame(i, confident=True))
        growing.close()
        again = nacre.open_sequence(tmp_path / "r")
        assert (again.format, len(again), again.camera, again.depth_scale) == ("plain", 3, CAMERA, 1000)
        for i, view in enumerate(again):
            expected = frame(i, confident=True)
            np.testing.assert_allclose(view.depth, expected.depth, atol=1e-6)
            assert view.color is not None
            np.testing.assert_allclose(view.color.astype(int), expected.color, atol=4)  # type: ignore[arg-type]
            np.testing.assert_array_equal(view.mask, expected.mask)
            assert view.timestamp == expected.timestamp

    def test_it_is_whole_before_it_is_closed(self, tmp_path: Path) -> None:
        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        growing.add(frame(0))
        growing.add(frame(1))
        growing._settle(0)
        assert len(nacre.open_sequence(tmp_path / "r")) == 2
        growing.close()

    def test_a_recording_is_never_overwritten(self, tmp_path: Path) -> None:
        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        growing.add(frame(0))
        growing.close()
        with pytest.raises(FileExistsError, match="holds a recording already"):
            GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")

    def test_without_a_view_nothing_is_left(self, tmp_path: Path) -> None:
        GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave").close()
        assert not (tmp_path / "r").exists()

    def test_a_disk_that_takes_no_more(self, tmp_path: Path) -> None:
        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        (tmp_path / "r" / "depth").rmdir()
        growing.add(frame(0))
        with pytest.raises(nacre.CameraError, match=r"images cannot be kept in .*r: No such file"):
            growing.close()


def write_wave(folder: Path, count: int = 8, seconds: float | None = 1 / 30) -> Path:
    frames = [frame(i) for i in range(count)]
    nacre.write_recording(
        folder, CAMERA, [f.depth for f in frames], depth_scale=1000,
        timestamps=None if seconds is None else [5 + seconds * i for i in range(count)],
    )  # fmt: skip
    return folder


class TestFeed:
    def test_where_nothing_is_dropped_it_is_the_same_run(self, tmp_path: Path) -> None:
        from nacre.reconstruction import Reconstruction
        from nacre.reconstruction.live_feed import LiveFeed, real_time_feed

        sequence = nacre.open_sequence(write_wave(tmp_path / "r", 6, 0.001))
        plain = Reconstruction(sequence, nacre.Model(CAMERA))
        list(plain.run())
        played = Reconstruction(sequence, nacre.Model(CAMERA))
        feed = real_time_feed(sequence, range(6))
        list(played.run(feed))
        assert feed.figures["num_dropped"] == 0
        growing = GrowingRecording(tmp_path / "kept", CAMERA, 1000, "wave")
        live = Reconstruction(growing, nacre.Model(CAMERA))
        frames = LiveQueue((frame(i) for i in range(6)), size=6)
        list(live.run(LiveFeed(growing, frames, growing.add, close=growing.close)))
        for run in (played, live):
            np.testing.assert_array_equal(run.model.points, plain.model.points)
            np.testing.assert_array_equal(run.poses, plain.poses)

    def test_frames_are_picked(self, tmp_path: Path) -> None:
        from nacre.reconstruction.live_feed import LiveFeed

        growing = GrowingRecording(tmp_path / "r", CAMERA, 1000, "wave")
        frames = LiveQueue((frame(i) for i in range(9)), size=9)
        feed = LiveFeed(growing, frames, growing.add, (1, 7, 2), growing.close)
        assert list(feed) == [1, 3, 5]
        feed.close()
        assert nacre.open_sequence(tmp_path / "r").timestamp(5) == frame(5).timestamp


class TestRealTime:
    @pytest.mark.parametrize("seconds", [0.02, None])
    def test_each_view_comes_at_its_time(self, seconds: float | None, tmp_path: Path) -> None:
        sequence = nacre.open_sequence(write_wave(tmp_path / "r", 4, seconds))
        start = time.monotonic()
        came = [(index, time.monotonic() - start) for index in in_real_time(sequence, range(4))]
        assert [index for index, _ in came] == [0, 1, 2, 3]
        for index, when in came:
            assert when >= (seconds or 1 / 30) * index - 1e-3

    def test_the_command_drops_and_tells(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from nacre.cli import main
        from nacre.reconstruction import Reconstruction

        add = Reconstruction._add

        def slowly(self: Reconstruction, *arguments: Any, **options: Any) -> object:
            time.sleep(0.05)
            return add(self, *arguments, **options)

        monkeypatch.setattr(Reconstruction, "_add", slowly)
        write_wave(tmp_path / "r", 80, 0.001)
        with pytest.raises(SystemExit) as end:
            main(
                ["reconstruct", str(tmp_path / "r"), "-o", str(tmp_path / "out"), "--realtime", "--no-retry"]
            )
        assert not end.value.code
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        live = report["live"]
        assert (live["camera"], live["num_received"]) == (False, 80)
        assert live["num_dropped"] > 20
        assert report["num_frames"] == 80 - live["num_dropped"]
        indices = [entry["index"] for entry in report["frames"]]
        assert indices == sorted(indices)
        assert indices[-1] == 79
        told = f"{live['num_dropped']} of 80: they came faster than they could be registered"
        assert told in capsys.readouterr().out
        assert report["source"].endswith(f"{live['num_dropped']} of 80 frames dropped")
        assert told in (tmp_path / "out" / "report.html").read_text()
