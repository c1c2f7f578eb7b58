"""Runs that were killed or stopped: resumed they give the same bytes, or say what is wrong."""

import errno
import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.reconstruction import Reconstruction

pytest.importorskip("typer")
import test_depth_calibration as tilted
from killed_runs import (  # noqa: F401  fixtures
    Killed,
    command,
    killed_after,
    plain_page,
    recording_with_gaps,
    results,
    undisturbed_results,
)

from nacre.reconstruction.journal import _line, read_journal


class TestKilled:
    @pytest.mark.parametrize("every", ["0", pytest.param("1", marks=pytest.mark.weekly), "3"])
    def test_after_any_frame_it_goes_on_to_the_same_bytes(
        self, recording: Path, undisturbed: Any, tmp_path: Path, every: str
    ) -> None:
        statuses = [frame["status"] for frame in undisturbed[2]["frames"]]
        assert "LOST" in statuses
        assert "RELOCALISED" in statuses
        for count in (1, 2, 5, 7, 8):  # those after the seventh are lost ones that are tried again
            out = tmp_path / f"{count}"
            killed_after(count, "reconstruct", recording, "-o", out, "--checkpoint-every", every)
            assert len(read_journal(out / "unfinished" / "journal.txt")[0]) == count
            killed_after(1, "reconstruct", "--resume", out, "--checkpoint-every", every)
            assert command("reconstruct", "--resume", out)[0] == 0
            assert results(out) == undisturbed
            assert not (out / "unfinished").exists()

    @pytest.mark.slow
    def test_while_depth_is_calibrated_and_after(self, tmp_path: Path) -> None:
        depths, poses = tilted.room.__wrapped__()  # type: ignore[attr-defined]
        wrong = [depth / (1.0 + 0.01 * tilted.SIDE * depth) for depth in depths]
        folder = tmp_path / "recording"
        nacre.write_recording(folder, tilted.CAMERA, wrong, depth_scale=5000, poses=poses)
        assert command("reconstruct", folder, "-o", tmp_path / "whole")[0] == 0
        expected = results(tmp_path / "whole")
        assert expected[2]["depth_calibration"]["used"]
        for count, every in ((4, 3), (8, 3)):
            out = tmp_path / f"{count}-{every}"
            killed_after(count, "reconstruct", folder, "-o", out, "--checkpoint-every", every)
            assert command("reconstruct", "--resume", out)[0] == 0
            assert results(out) == expected

    def test_while_results_are_written(
        self, recording: Path, undisturbed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def kill(*_: Any, **__: Any) -> None:
            raise Killed

        for name in ("write_points", "write_trajectory"):
            with monkeypatch.context() as patch:
                patch.setattr(f"nacre.reconstruction.results.{name}", kill)
                with pytest.raises(Killed):
                    command("reconstruct", recording, "-o", tmp_path / name)
            assert command("reconstruct", "--resume", tmp_path / name)[0] == 0
            assert results(tmp_path / name) == undisturbed

    @pytest.mark.parametrize(
        ("error", "told", "where"),
        [
            (MemoryError("std::bad_alloc"), "not enough memory: std::bad_alloc", "there is more memory"),
            (
                OSError(errno.EIO, "Input/output error", "x"),
                "input/output error: x",
                "files can be written again",
            ),
        ],
    )
    @pytest.mark.parametrize("name", ["reconstruction.results.write_points", "Model.add_frame"])
    def test_it_goes_on_where_there_is_what_it_lacked(
        self,
        recording: Path,
        undisturbed: Any,
        tmp_path: Path,
        name: str,
        error: Exception,
        told: str,
        where: str,
    ) -> None:
        def fail(*_: Any, **__: Any) -> None:
            raise error

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(f"nacre.{name}", fail)
            code, out, err = command("reconstruct", recording, "-o", tmp_path / "o")
        assert (code, err) == (1, f"error: {told}\n")
        assert out.endswith(f"nacre reconstruct --resume {tmp_path / 'o'} goes on where {where}\n")
        assert command("reconstruct", "--resume", tmp_path / "o")[0] == 0
        assert results(tmp_path / "o") == undisturbed

    def test_a_torn_line_of_the_journal_is_the_frame_in_flight(
        self, recording: Path, undisturbed: Any, tmp_path: Path
    ) -> None:
        killed_after(4, "reconstruct", recording, "-o", tmp_path / "o")
        journal = tmp_path / "o" / "unfinished" / "journal.txt"
        journal.write_bytes(journal.read_bytes()[:-5])
        (tmp_path / "o" / ".model.ply.abcd1234.tmp").write_bytes(b"half")
        assert len(read_journal(journal)[0]) == 3
        assert "3" in command("info", tmp_path / "o")[1]
        assert command("reconstruct", "--resume", tmp_path / "o")[0] == 0
        assert results(tmp_path / "o") == undisturbed
        assert not list((tmp_path / "o").glob(".*"))

    def test_a_damaged_line_of_the_journal_loses_no_frame(
        self, recording: Path, undisturbed: Any, tmp_path: Path
    ) -> None:
        killed_after(5, "reconstruct", recording, "-o", tmp_path / "o", "--checkpoint-every", 3)
        journal = tmp_path / "o" / "unfinished" / "journal.txt"
        lines = journal.read_bytes().splitlines(keepends=True)
        journal.write_bytes(lines[0] + b"#" + b"".join(lines[1:]))
        # What is noted from here on is compared with what is done again, though lines are missing before it.
        for count, every in ((1, 1), (4, 0)):
            killed_after(count, "reconstruct", "--resume", tmp_path / "o", "--checkpoint-every", every)
        assert len(read_journal(journal)[0]) == 6
        assert command("reconstruct", "--resume", tmp_path / "o")[0] == 0
        assert results(tmp_path / "o") == undisturbed

    def test_a_run_that_is_begun_again_says_so(
        self, recording: Path, undisturbed: Any, tmp_path: Path
    ) -> None:
        killed_after(4, "reconstruct", recording, "-o", tmp_path / "o")
        code, _, told = command("reconstruct", recording, "-o", tmp_path / "o")
        assert code == 0
        assert "held an unfinished run" in told
        assert results(tmp_path / "o") == undisturbed


class TestRefused:
    @pytest.fixture
    def killed(self, recording: Path, tmp_path: Path) -> tuple[Path, Path]:
        copied = tmp_path / "recording"
        shutil.copytree(recording, copied)
        killed_after(5, "reconstruct", copied, "-o", tmp_path / "o", "--checkpoint-every", 3)
        return copied, tmp_path / "o"

    def fails(self, code: int, *arguments: Any) -> str:
        got, _, err = command("reconstruct", *arguments)
        assert got == code, err
        assert err.startswith("error: ") or "\nerror: " in err
        assert "Traceback" not in err
        return err

    def test_there_is_nothing_to_resume(self, recording: Path, tmp_path: Path) -> None:
        assert "there is no folder" in self.fails(2, "--resume", tmp_path / "none")
        assert "holds no unfinished run" in self.fails(2, "--resume", tmp_path)
        command("reconstruct", recording, "-o", tmp_path / "o", "--last", 0)
        assert "finished: there is nothing to resume" in self.fails(2, "--resume", tmp_path / "o")

    def test_options_are_those_of_the_run(self, killed: tuple[Path, Path]) -> None:
        assert "leave out --every" in self.fails(2, "--resume", killed[1], "--every", 2)
        assert "leave out SOURCE" in self.fails(2, killed[0], "--resume", killed[1])

    def test_the_report_that_was_asked_for_is_among_them(self, recording: Path, tmp_path: Path) -> None:
        out = tmp_path / "o"
        killed_after(3, "reconstruct", recording, "-o", out, "--no-report", "--min-tracked", 1)
        assert "leave out --report" in self.fails(2, "--resume", out, "--no-report")
        assert "leave out --min-tracked" in self.fails(2, "--resume", out, "--min-tracked", 0.1)
        code, _, _ = command("reconstruct", "--resume", out)
        report = json.loads((out / "report.json").read_text())
        assert (code, report["num_tracked"] < report["num_frames"]) == (3, True)
        assert not (out / "report.html").exists()

    def test_another_recording(self, killed: tuple[Path, Path]) -> None:
        (killed[0] / "depth" / "000006.png").unlink()
        told = self.fails(1, "--resume", killed[1])
        assert "not the recording that it was" in told
        assert told.rstrip().endswith("run it again without --resume")

    def test_a_frame_that_changed_before_the_kill(self, killed: tuple[Path, Path]) -> None:
        image = killed[0] / "depth" / "000004.png"
        other = nacre.io.images.read_depth(image).astype(np.uint16)
        other[other > 0] = other[other > 0] // 8 * 8 + 40  # coarser: no larger a file
        size = image.stat().st_size
        nacre.io.images.write_depth_png(image, other)
        with image.open("ab") as stream:  # what follows a PNG's end is no part of it
            stream.write(bytes(size - image.stat().st_size))
        assert image.stat().st_size == size
        assert "has changed" in self.fails(1, "--resume", killed[1])

    def test_a_damaged_checkpoint(self, killed: tuple[Path, Path]) -> None:
        checkpoint = killed[1] / "unfinished" / "checkpoint"
        data = bytearray(checkpoint.read_bytes())
        data[len(data) // 2] ^= 4
        checkpoint.write_bytes(data)
        assert f"{checkpoint}, byte 40: it is damaged" in self.fails(1, "--resume", killed[1])

    def test_a_journal_that_names_a_frame_of_no_recording(self, recording: Path, tmp_path: Path) -> None:
        killed_after(3, "reconstruct", recording, "-o", tmp_path / "o", "--realtime")
        journal = tmp_path / "o" / "unfinished" / "journal.txt"
        with journal.open("ab") as stream:
            stream.write(_line([7, None, "LOST", None]))
        message = f"{journal}: frame 7 is none of the recording's 7"
        assert message in self.fails(1, "--resume", tmp_path / "o")

    def test_a_run_file_that_is_none(self, killed: tuple[Path, Path]) -> None:
        asked = killed[1] / "unfinished" / "run.json"
        for text in ("{", "[]", "{}", '{"format": 1, "options": {"path": 1}, "folder": "."}'):
            asked.write_text(text)
            assert str(asked) in self.fails(1, "--resume", killed[1])


def test_python_code_can_resume_too(recording: Path, undisturbed: Any, tmp_path: Path) -> None:
    sequence = nacre.open_sequence(recording)
    whole = nacre.reconstruct(recording)
    done = Reconstruction(sequence, nacre.Model(sequence.camera))

    def frames() -> Iterator[Any]:
        yield from done.run()
        yield from done.retry_lost()

    for k, _ in enumerate(frames()):
        done.save(tmp_path / "run")
        if k in (2, 8):
            other = Reconstruction.load(tmp_path / "run", sequence)
            assert other.frames == done.frames
            other.complete()
            assert other.model.points.tobytes() == whole.model.points.tobytes()
            assert other.frames[-1].report == other.model.frames[other.frames[-1].report.index]  # type: ignore[union-attr]
            assert [f.status for f in other.frames] == [f.status for f in whole.frames]


def test_a_lost_frame_that_is_not_there_any_more_stays_lost(recording: Path, tmp_path: Path) -> None:
    sequence = nacre.open_sequence(recording)
    done = Reconstruction(sequence, nacre.Model(sequence.camera))
    lost, *_ = (frame for frame in done.run() if frame.status == "LOST")
    done.save(tmp_path / "run")
    other = Reconstruction.load(tmp_path / "run", [sequence[i] for i in range(lost.index)]).complete()
    assert other.frames[lost.index] == lost
    assert done.complete().frames[lost.index].status == "RELOCALISED"


SLOW_RUN = """
import sys, time
from nacre.cli import main
from nacre.reconstruction import Reconstruction
add = Reconstruction._add
def slow(self, *arguments, **options):
    time.sleep({seconds})
    return add(self, *arguments, **options)
Reconstruction._add = slow
import nacre.report
def page(data):
    print("page", flush=True)
    time.sleep({page})
    return "<html></html>"
nacre.report.render_page = page
main()
"""


class TestSignals:
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
    @pytest.mark.parametrize("when", ["frames", "results"])
    def test_it_is_saved_and_goes_on(
        self, recording: Path, undisturbed: Any, tmp_path: Path, number: int, when: str
    ) -> None:
        out = tmp_path / "o"
        code = SLOW_RUN.format(seconds=0.1 if when == "frames" else 0, page=0 if when == "frames" else 60)
        words = [sys.executable, "-c", code, "reconstruct", str(recording), "-o", str(out)]
        journal = out / "unfinished" / "journal.txt"
        running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if when == "results":
            assert running.stdout is not None
            while "page" not in (line := running.stdout.readline()):
                assert line, "it ended before the page"
        while not (journal.exists() and len(read_journal(journal)[0]) >= 3):
            time.sleep(0.01)
        start = time.monotonic()
        running.send_signal(number)
        told, errors = running.communicate(timeout=60)
        took = time.monotonic() - start
        assert running.returncode == 128 + number, errors
        assert took < 2
        assert f"nacre reconstruct --resume {out}" in told
        report = json.loads((out / "report.json").read_text())
        assert report["interrupted"]
        assert 3 <= len(report["frames"]) <= 7
        assert len(nacre.read_points(out / "model.ply")) > 0
        assert command("reconstruct", "--resume", out)[0] == 0
        assert results(out) == undisturbed


@pytest.mark.data
@pytest.mark.weekly
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_a_large_model_is_saved_within_two_seconds(recordings: Path, tmp_path: Path, number: int) -> None:
    code = "from nacre.cli import main; main()"
    words = ["reconstruct", recordings / "tum-fr3-teddy", "-o", tmp_path, "--set", "spacing=0.002"]
    journal = tmp_path / "unfinished" / "journal.txt"
    running = subprocess.Popen([sys.executable, "-c", code, *map(str, words)], stdout=subprocess.DEVNULL)
    while not (journal.exists() and len(read_journal(journal)[0]) >= 150):
        assert running.poll() is None
        time.sleep(0.02)
    start = time.monotonic()
    running.send_signal(number)
    assert running.wait(60) == 128 + number
    assert time.monotonic() - start < 2
    assert len(nacre.read_points(tmp_path / "model.ply")) > 100_000


def test_a_camera_that_was_killed_leaves_a_whole_recording(tmp_path: Path) -> None:
    from nacre.datasets import SequenceFrame
    from nacre.datasets.recorder import GrowingRecording, mend

    camera = nacre.Camera(24, 20, 30.0, 30.0, 11.5, 9.5)
    growing = GrowingRecording(tmp_path, camera, 1000, "name")
    for i in range(4):
        growing.add(SequenceFrame(i, np.full((20, 24), 1.0 + i, np.float32), camera, 0.1 * i, None, None))
    growing.settle()
    (tmp_path / "depth" / ".000004.png.abcd1234.tmp").write_bytes(b"half")
    times = tmp_path / "timestamps.txt"
    times.write_bytes(times.read_bytes()[:-3])  # the line of the last is torn
    mend(tmp_path)
    assert len(nacre.open_sequence(tmp_path)) == 3
    assert nacre.open_sequence(tmp_path)[2].timestamp == 0.2
    assert sorted(path.name for path in (tmp_path / "depth").iterdir()) == [f"{i:06d}.png" for i in range(3)]


@pytest.mark.slow
@pytest.mark.parametrize("kills", ["5", pytest.param("30", marks=pytest.mark.weekly)])
def test_killed_at_random_moments(kills: str) -> None:
    script = Path(__file__).resolve().parents[3] / "benchmarks" / "kills.py"
    done = subprocess.run(
        [sys.executable, str(script), "--kills", kills, "--views", "12", "--plain-page"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "no frame lost but those in flight" in done.stdout
