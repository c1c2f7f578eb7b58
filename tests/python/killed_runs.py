"""Runs of the command line that are killed after so many frames, and what they should have written."""

import contextlib
import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_wide_views import view

import nacre
from nacre.cli import main
from nacre.reconstruction.resume import UnfinishedRun

NACRE = [sys.executable, "-c", "from nacre.cli import main; main()"]
"""The command line as a process of its own."""


class Killed(BaseException):
    """Ends a process, as far as its files are concerned."""


def command(*arguments: Any) -> tuple[int, str, str]:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main([str(word) for word in arguments])
        except SystemExit as stopped:
            return int(stopped.code or 0), out.getvalue(), err.getvalue()
    raise AssertionError("it did not exit")


def killed_after(count: int, *arguments: Any) -> None:
    """Run a command that ends when so many frames are done."""
    whole, frames = UnfinishedRun.add, iter(range(10_000))

    def add(self: UnfinishedRun, *more: Any) -> None:
        whole(self, *more)
        if next(frames) + 1 == count:
            raise Killed

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(UnfinishedRun, "add", add)
        with pytest.raises(Killed):
            command(*arguments)


def results(out: Path) -> tuple[bytes, bytes, Any]:
    def without_times(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: without_times(item) for name, item in value.items() if name != "milliseconds"}
        return [without_times(item) for item in value] if isinstance(value, list) else value

    report = json.loads((out / "report.json").read_text())
    return (out / "model.ply").read_bytes(), (out / "trajectory.txt").read_bytes(), without_times(report)


@pytest.fixture(autouse=True)
def plain_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pictures take seconds."""
    import nacre.report

    monkeypatch.setattr(nacre.report, "render_page", lambda data: "<html></html>")


@pytest.fixture(scope="module", name="recording")
def recording_with_gaps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven views: one sees nothing, and two come before what they can be registered to."""
    folder = tmp_path_factory.mktemp("resume") / "recording"
    degrees = (0, 180, 15, None, 30, 60, 120)
    depth = [np.full_like(view(0), np.nan) if angle is None else view(angle) for angle in degrees]
    nacre.write_recording(folder, nacre.default_camera(nacre.built_in_object()), depth, depth_scale=20000)
    return folder


@pytest.fixture(scope="module", name="undisturbed")
def undisturbed_results(
    recording: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[bytes, bytes, Any]:
    out = tmp_path_factory.mktemp("resume") / "out"
    with pytest.MonkeyPatch.context() as patch:
        import nacre.report

        patch.setattr(nacre.report, "render_page", lambda data: "<html></html>")
        assert command("reconstruct", recording, "-o", out)[0] == 0
    assert not (out / "unfinished").exists()
    return results(out)
