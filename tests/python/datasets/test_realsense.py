"""RealSense: the SDK's own recordings, played back and read; cameras that are there, missing or unplugged."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path
from typing import Any

import fake_realsense as fake
import numpy as np
import pytest

import nacre
from nacre.datasets import LiveQueue, RealSense, realsense
from nacre.viewer import read_timeline

pytest.importorskip("PIL")
WIDTH, HEIGHT, FRAMES, SHIFT = 64, 48, 6, 0.1


def video_stream(rs: Any, stream: Any, uid: int, format: Any, size: int) -> Any:
    video = rs.video_stream()
    video.type, video.index, video.uid, video.fmt, video.bpp, video.fps = stream, 0, uid, format, size, 30
    video.width, video.height = WIDTH, HEIGHT
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy, lens.ppx, lens.ppy = WIDTH, HEIGHT, 60.0, 61.0, 31.5, 23.5
    lens.model, lens.coeffs = rs.distortion.none, [0.0] * 5
    video.intrinsics = lens
    return video


def show(rs: Any, sensor: Any, profile: Any, i: int, pixels: np.ndarray) -> None:
    frame = rs.software_video_frame()
    frame.bpp = pixels.dtype.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
    frame.stride = frame.bpp * WIDTH
    frame.timestamp, frame.domain, frame.frame_number = 1000 + 40 * i, rs.timestamp_domain.hardware_clock, i
    frame.profile, frame.pixels = profile.as_video_stream_profile(), pixels
    sensor.on_video_frame(frame)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a camera of software with the SDK's own recorder; its colour sensor is 10 cm to the right."""
    rs = pytest.importorskip("pyrealsense2")
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "Software camera")
    device.register_info(rs.camera_info.serial_number, "0815")
    sensors = [device.add_sensor("Depth"), device.add_sensor("Color")]
    depth = sensors[0].add_video_stream(video_stream(rs, rs.stream.depth, 0, rs.format.z16, 2))
    color = sensors[1].add_video_stream(video_stream(rs, rs.stream.color, 1, rs.format.rgb8, 3))
    sensors[0].add_read_only_option(rs.option.depth_units, 0.0005)
    motion = rs.extrinsics()
    motion.rotation, motion.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], [-SHIFT, 0, 0]
    depth.as_video_stream_profile().register_extrinsics_to(color, motion)
    path = tmp_path_factory.mktemp("realsense") / "recorded.db3"
    recorder = rs.recorder(str(path), device)
    queues = []
    for sensor in recorder.query_sensors():
        queues.append(rs.frame_queue(50, keep_frames=True))
        sensor.open(sensor.get_stream_profiles())
        sensor.start(queues[-1])
    columns = np.broadcast_to(np.arange(WIDTH, dtype=np.uint8), (HEIGHT, WIDTH))
    for i in range(FRAMES):
        measured = np.full((HEIGHT, WIDTH), 1200 + 2 * i, np.uint16)
        measured[0], measured[1] = 0, 65535
        show(rs, sensors[0], depth, i, measured)
        show(rs, sensors[1], color, i, np.stack([columns, columns * 0 + 7, columns * 0 + i], axis=-1))
        time.sleep(0.02)
    end = time.monotonic() + 10
    while time.monotonic() < end and any(queue.size() < FRAMES for queue in queues):
        time.sleep(0.01)
    for sensor in recorder.query_sensors():
        sensor.stop()
        sensor.close()
    del recorder
    return path


class TestTheLibrarysOwnFiles:
    def test_playback_is_a_camera(self, recorded: Path) -> None:
        with RealSense(file=recorded) as camera, LiveQueue(camera, size=FRAMES) as queue:
            assert (camera.name, camera.serial) == ("Software camera", "0815")
            assert camera.depth_scale == 2000
            assert camera.camera == nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5)
            frames = list(queue)
        # Playback goes on while the camera is opened: the first frames may be gone.
        assert 1 <= len(frames) <= FRAMES
        times = [frame.timestamp for frame in frames]
        assert times == sorted(set(times))
        for frame in frames:
            i = round((frame.timestamp - 1) / 0.04)
            assert np.isnan(frame.depth[:2]).all()
            np.testing.assert_allclose(frame.depth[2:], 0.6 + 0.001 * i, atol=1e-6)

    def test_colour_is_laid_over_depth(self, recorded: Path) -> None:
        with RealSense(file=recorded) as camera:
            frame = [frame for frame in camera if frame.color is not None][-1]
        assert frame.color is not None
        assert frame.color[20, 40, 1] == 7
        # A point at depth z is seen fx SHIFT / z further to the left by what is further to the right.
        expected = 40 - camera.camera.fx * SHIFT / frame.depth[20, 40]
        assert float(frame.color[20, 40, 0]) == pytest.approx(expected, abs=1)

    def test_without_colour(self, recorded: Path) -> None:
        with RealSense(file=recorded, color=False) as camera:
            assert all(frame.color is None for frame in camera)

    def test_the_reader_of_recordings_takes_them_too(self, recorded: Path) -> None:
        pytest.importorskip("rosbags")
        sequence = nacre.open_sequence(recorded)
        assert (sequence.format, len(sequence), sequence.depth_scale) == ("rosbag", FRAMES, 2000)
        assert sequence.camera == nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5)
        for i, frame in enumerate(sequence):
            assert np.isnan(frame.depth[:2]).all()
            np.testing.assert_allclose(frame.depth[2:], 0.6 + 0.001 * i, atol=1e-6)

    def test_what_is_played_is_recorded(self, recorded: Path, tmp_path: Path) -> None:
        from nacre.cli.app import run

        command = [
            "record",
            f"realsense:{recorded}",
            "-o",
            str(tmp_path / "out"),
            "--no-window",
            "--no-report",
        ]
        assert run(command) in (0, 3)  # a plane tells little of where the camera is
        kept = nacre.open_sequence(tmp_path / "out" / "recording")
        assert 1 <= len(kept) <= FRAMES
        assert kept.depth_scale == 2000
        for frame in kept:
            i = round((frame.timestamp - 1) / 0.04)
            np.testing.assert_allclose(frame.depth[2:], 0.6 + 0.001 * i, atol=1e-6)

    @pytest.mark.parametrize("content", [b"", b"not a recording" * 100])
    def test_what_is_no_recording(self, content: bytes, tmp_path: Path) -> None:
        pytest.importorskip("pyrealsense2")
        path = tmp_path / "broken.db3"
        path.write_bytes(content)
        with pytest.raises(nacre.FileFormatError, match=r"broken\.db3: the RealSense library cannot play it"):
            RealSense(file=path)

    def test_no_camera_of_the_librarys(self) -> None:
        rs = pytest.importorskip("pyrealsense2")
        if len(rs.context().query_devices()):
            pytest.skip("there is a camera")
        with pytest.raises(nacre.CameraError, match="no RealSense camera was found: plug"):
            RealSense()


class TestCameras:
    @pytest.fixture
    def plug(self, monkeypatch: pytest.MonkeyPatch) -> Any:
        def plug(**options: Any) -> Any:
            library = fake.Library(**options)
            monkeypatch.setattr(realsense, "_library", lambda: library)
            return library

        return plug

    def test_its_frames(self, plug: Any) -> None:
        library = plug(frames=3, unplugged=True, seconds=0.0)
        camera = RealSense()
        assert camera.camera == nacre.Camera(fake.WIDTH, fake.HEIGHT, 90, 91, 47.5, 35.5)
        assert camera.depth_scale == 1000
        frames = iter(camera)
        for i in range(3):
            frame = next(frames)
            assert frame.index == i
            assert np.isnan(frame.depth[0]).all()
            np.testing.assert_allclose(frame.depth[1:], 0.001 * fake.wave(i)[1:], rtol=1e-6)
            assert frame.timestamp == pytest.approx(1 + 0.0333 * i)
        with pytest.raises(nacre.CameraError, match="Fake D435 0815 was unplugged"):
            next(frames)
        camera.close()
        assert library.stopped

    def test_pixels_of_no_confidence_are_masked(self, plug: Any) -> None:
        plug(frames=1, confident=True)
        mask = next(iter(RealSense())).mask
        assert mask is not None
        assert not mask[:, :10].any()
        assert mask[:, 10:].all()

    def test_a_camera_is_chosen_by_its_serial_number(self, plug: Any) -> None:
        library = plug(serials=("0815", "4711"))
        assert RealSense("4711").serial == "4711"
        assert library.enabled["device"] == "4711"
        with pytest.raises(nacre.CameraError, match="serial number 99; there are 0815, 4711"):
            RealSense("99")

    def test_silence(self, plug: Any) -> None:
        plug(frames=1, seconds=0.01)
        frames = iter(RealSense(timeout=0.05))
        next(frames)
        with pytest.raises(nacre.CameraError, match=r"gave no frame for 0\.05 s: plug it in again"):
            next(frames)

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"serials": ()}, "no RealSense camera was found"),
            ({"busy": True}, "does not start: .*resource busy; is another program using it"),
            ({"streams": ("color",)}, "Fake D435 has no depth"),
        ],
    )
    def test_cameras_that_cannot_be_used(self, plug: Any, options: Any, message: str) -> None:
        plug(**options)
        with pytest.raises(nacre.CameraError, match=message):
            RealSense()

    def test_the_depth_cameras_distortion(self, plug: Any) -> None:
        plug(coefficients=(0.1, -0.2, 0.001, 0.002, 0.05))
        assert list(RealSense().camera.distortion) == [0.1, -0.2, 0.001, 0.002, 0.05]

    def test_without_the_library(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "pyrealsense2", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[realsense\]"'):
            RealSense()


class TestTheCommand:
    def test_what_it_saw_before_it_was_killed_can_be_finished(self, tmp_path: Path) -> None:
        from nacre.reconstruction.journal import read_journal

        out = tmp_path / "out"
        running = fake.start("", "reconstruct", "realsense", "-o", str(out))
        journal, end = out / "unfinished" / "journal.txt", time.monotonic() + 60
        while time.monotonic() < end and len(read_journal(journal)[0]) < 4:
            time.sleep(0.02)
        running.kill()
        running.communicate()
        entries, _ = read_journal(journal)
        assert len(entries) >= 4
        told, errors = fake.start("", "reconstruct", "--resume", str(out)).communicate(timeout=60)
        report = json.loads((out / "report.json").read_text())
        assert report["num_frames"] >= len(entries), errors
        assert [frame["timestamp"] for frame in report["frames"][: len(entries)]] == [e[1] for e in entries]
        assert report["live"]["camera"]
        assert "model.ply" in told

    def test_ctrl_c_ends_it_with_everything_written(self, tmp_path: Path) -> None:
        out = tmp_path / "out"
        running = fake.start("", "reconstruct", "realsense", "-o", str(out))
        end = time.monotonic() + 60
        while time.monotonic() < end and len(list(out.glob("recording/depth/*.png"))) < 4:
            time.sleep(0.02)
        running.send_signal(signal.SIGINT)
        told, errors = running.communicate(timeout=60)
        assert running.returncode == 0, errors
        report = json.loads((out / "report.json").read_text())
        assert report["live"]["camera"]
        assert report["live"]["stopped"] is None
        assert report["num_frames"] >= 4
        assert report["num_tracked"] >= 1
        assert report["live"]["num_received"] >= report["num_frames"] + report["live"]["num_dropped"]
        assert "frames dropped" in told
        assert "Fake D435 0815: live, pinhole camera 96 x 72" in told
        assert len(nacre.read_points(out / "model.ply")) > 100
        again = nacre.open_sequence(out / "recording")
        assert len(again) == report["num_frames"]
        assert again.has_timestamps
        depth_of = read_timeline(out).depth_of
        assert depth_of is not None
        np.testing.assert_array_equal(depth_of(1), again[1].depth)
        np.testing.assert_allclose(again[1].timestamp - again[0].timestamp, 0.0333, atol=0.5)

    def test_a_camera_that_is_unplugged_leaves_what_it_saw(self, tmp_path: Path) -> None:
        out = tmp_path / "out"
        running = fake.start("frames=5, unplugged=True", "reconstruct", "realsense", "-o", str(out))
        _, errors = running.communicate(timeout=60)
        assert running.returncode == 1
        assert "error: Fake D435 0815 was unplugged; what there is was written" in errors
        report = json.loads((out / "report.json").read_text())
        assert report["num_frames"] == 5
        assert report["live"]["stopped"] == "Fake D435 0815 was unplugged"

    def test_info_tells_of_a_camera(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        from nacre.cli.app import run

        library = fake.Library(confident=True)
        monkeypatch.setattr(realsense, "_library", lambda: library)
        assert run(["info", "realsense"]) == 0
        told = capsys.readouterr().out
        assert "Fake D435, serial number 0815" in told
        assert "pinhole camera 96 x 72" in told
        assert library.stopped

    def test_no_camera_and_wrong_usage(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        from nacre.cli.app import run

        monkeypatch.setattr(realsense, "_library", lambda: fake.Library(serials=()))
        out = str(tmp_path / "out")
        assert run(["reconstruct", "realsense", "-o", out]) == 1
        assert "error: no RealSense camera was found: plug" in capsys.readouterr().err
        assert run(["reconstruct", "realsense:7", "-o", out, "--depth-scale", "1000"]) == 2
        assert "--depth-scale is for recordings, and realsense:7 is a camera" in capsys.readouterr().err
        monkeypatch.setattr(realsense, "_library", lambda: fake.Library())
        nacre.write_recording(
            tmp_path / "out" / "recording", nacre.Camera(4, 3, 5, 5, 1.5, 1), [np.ones((3, 4))], depth_scale=1
        )
        assert run(["reconstruct", "realsense", "-o", out]) == 2
        assert "holds a recording already; give another folder" in capsys.readouterr().err
