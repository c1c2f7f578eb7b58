"""Disks that are full or broken: whoever writes says which file, and leaves the one before as it was."""

import contextlib
import errno
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from killed_runs import command, plain_page, recording_with_gaps, results, undisturbed_results  # noqa: F401  fixtures

import nacre
from nacre.io import atomic
from nacre.reconstruction import Reconstruction

POINTS = np.random.default_rng(0).random((2000, 3))
CAMERA = nacre.Camera(24, 20, 30.0, 30.0, 11.5, 9.5)
TRIANGLES = np.random.default_rng(1).integers(0, 2000, (500, 3))


def write_run(path: Path) -> None:
    Reconstruction([], nacre.Model(CAMERA)).save(path)


def write_html(path: Path) -> None:
    from nacre.report import ReportData, write_report

    write_report(path, ReportData(title="t", source="s", frames=[]))


def write_image(path: Path) -> None:
    from nacre.io.images import write_depth_png

    write_depth_png(path, np.arange(480, dtype=np.uint16).reshape(20, 24))


def write_color(path: Path) -> None:
    from nacre.io.images import write_color_jpeg

    write_color_jpeg(path, np.zeros((20, 24, 3), np.uint8))


def write_laz(path: Path) -> None:
    pytest.importorskip("laspy")
    nacre.write_points(path, POINTS)


def timeline() -> Any:
    from nacre.viewer.timeline import Timeline

    return Timeline("title", CAMERA, depth_of=lambda index: np.ones((20, 24), np.float32))


def write_rerun(path: Path) -> None:
    pytest.importorskip("rerun")
    from nacre.viewer.rerun_file import export_rrd

    export_rrd(timeline(), path)


def write_page(path: Path) -> None:
    from nacre.report import ReportedFrame
    from nacre.viewer import Snapshot, export_html

    grown = timeline()
    grown.add(ReportedFrame(0, "TRACKED", world_from_camera=np.eye(4)))
    grown.set_snapshot(Snapshot(POINTS, np.broadcast_to(np.float32([0, 0, -1]), POINTS.shape), 0.1))
    export_html(grown, path)


WRITERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "PLY": ("a.ply", lambda path: nacre.write_points(path, POINTS)),
    "ASCII PLY": ("a.ply", lambda path: nacre.write_points(path, POINTS, binary=False)),
    "PCD": ("a.pcd", lambda path: nacre.write_points(path, POINTS)),
    "XYZ": ("a.xyz", lambda path: nacre.write_points(path, POINTS)),
    "NPZ": ("a.npz", lambda path: nacre.write_points(path, POINTS)),
    "LAZ": ("a.laz", write_laz),
    "mesh": ("m.ply", lambda path: nacre.write_mesh(path, POINTS, TRIANGLES)),
    "GLB": ("m.glb", lambda path: nacre.write_mesh(path, POINTS, TRIANGLES)),
    "OBJ": ("m.obj", lambda path: nacre.write_mesh(path, POINTS, TRIANGLES)),
    "STL": ("m.stl", lambda path: nacre.write_mesh(path, POINTS, TRIANGLES)),
    "trajectory": ("t.txt", lambda path: nacre.write_trajectory(path, [0.0, 1.0], np.stack([np.eye(4)] * 2))),
    "camera": ("camera.json", lambda path: nacre.write_camera(path, CAMERA, 1000)),
    "depth image": ("d.png", write_image),
    "colour image": ("c.jpg", write_color),
    "model": ("model.ckpt", lambda path: nacre.Model(CAMERA).save(path)),
    "run": ("run.ckpt", write_run),
    "report": ("report.html", write_html),
    "rerun": ("view.rrd", write_rerun),
    "viewer": ("view.html", write_page),
}


@contextlib.contextmanager
def failing(count: int, code: int) -> Iterator[list[int]]:
    """Let the n-th step on a disk fail: make a file, write, flush to disk, rename."""
    steps = [0]

    def counted(function: Any) -> Any:
        def call(*arguments: Any, **options: Any) -> Any:
            steps[0] += 1
            if steps[0] == count:
                raise OSError(code, os.strerror(code))
            return function(*arguments, **options)

        return call

    class Broken:
        def __init__(self, stream: Any) -> None:
            self._stream = stream
            self.write = counted(stream.write)

        def __getattr__(self, name: str) -> Any:
            return getattr(self._stream, name)

        def __enter__(self) -> "Broken":
            return self

        def __exit__(self, *_: object) -> None:
            self._stream.close()

    opened = Path.open

    def open_broken(path: Path, mode: str = "r", *more: Any, **options: Any) -> Any:
        stream = opened(path, mode, *more, **options)
        return Broken(stream) if mode == "wb" else stream

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(atomic, "_new_file_beside", counted(atomic._new_file_beside))
        patch.setattr(Path, "open", open_broken)
        patch.setattr(os, "fsync", counted(os.fsync))
        patch.setattr(Path, "replace", counted(Path.replace))
        yield steps


@pytest.mark.parametrize("name", WRITERS)
def test_every_step_may_fail(name: str, tmp_path: Path) -> None:
    file, write = WRITERS[name]
    path = tmp_path / file
    with failing(-1, 0) as steps:
        write(path)
    num_steps = steps[0]
    assert num_steps >= 3
    whole = path.read_bytes()
    path.write_bytes(b"before")
    for count in range(1, num_steps + 1):
        code = (errno.ENOSPC, errno.EIO)[count % 2]
        with failing(count, code), pytest.raises(OSError, match=os.strerror(code)) as caught:
            write(path)
        assert caught.value.filename == str(path), f"step {count} of {num_steps}"
        assert caught.value.errno == code
        # The last step, not of images, brings the new name to disk: then the new file is there, whole.
        is_named = count == num_steps and "image" not in name
        assert path.read_bytes() == (whole if is_named else b"before")
        assert [other.name for other in tmp_path.iterdir()] == [file]
        path.write_bytes(b"before")


LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
import nacre.report
nacre.report.render_page = lambda data: "<html></html>"
from nacre.cli import main
main()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="RLIMIT_FSIZE is POSIX")
def test_files_that_may_not_grow(recording: Path, undisturbed: Any, tmp_path: Path) -> None:
    """First the checkpoint is too large, then the journal, then the model; then nothing is."""
    out = tmp_path / "o"
    words: list[str] = ["reconstruct", str(recording), "-o", str(out), "--checkpoint-every", "2"]
    told = []
    for size in (20_000, 200_000):
        code = LIMITED.format(size=size)
        done = subprocess.run(
            [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
        )
        assert done.returncode == 1
        assert done.stderr.startswith("error: file too large: ")
        assert "Traceback" not in done.stderr
        told.append(done.stderr)
        assert not (out / "model.ply").exists()
        assert not list(out.rglob("*.tmp"))
        words = ["reconstruct", "--resume", str(out), "--checkpoint-every", "2"]
    assert str(out / "unfinished" / "checkpoint") in told[0]
    assert command("reconstruct", "--resume", out)[0] == 0
    assert results(out) == undisturbed


def test_a_disk_that_is_full(recording: Path, undisturbed: Any, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("only root can mount a small disk")
    try:
        ballast = disk / "ballast"
        messages = set()
        for kilobytes in (3066, 2900, 2600, 2300, 2000, 1600):
            ballast.write_bytes(bytes(1024 * kilobytes))
            resumes = (disk / "o" / "unfinished" / "run.json").exists()
            words = ("--resume", disk / "o") if resumes else (recording, "-o", disk / "o")
            code, _, err = command("reconstruct", *words, "--checkpoint-every", 1)
            if code == 0:
                break
            assert code in (1, 2), err
            assert "no space left on device" in err.lower()
            assert str(disk / "o") in err
            messages.add(err)
            ballast.unlink()
        assert messages
        ballast.unlink(missing_ok=True)
        if code != 0:
            words = (
                ("--resume", disk / "o")
                if (disk / "o" / "unfinished").exists()
                else (recording, "-o", disk / "o")
            )
            code, _, err = command("reconstruct", *words)
            assert code == 0, err
        assert results(disk / "o") == undisturbed
    finally:
        subprocess.run(["umount", str(disk)], check=True)
