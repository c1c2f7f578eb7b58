"""Cameras of OpenCV: their frames, and those that are missing, silent, odd, or without a driver."""

from __future__ import annotations

import sys
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.datasets import OpenCVCamera, opencv_camera

sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_opencv import ASUS, HEIGHT, OPENNI, ORBBEC, WIDTH, Error, Library, grabs

FIRST, OTHER = ((np.full(shape, 700, np.uint16), None) for shape in ((HEIGHT, WIDTH), (24, 32)))


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Any:
    def plug(*arguments: Any, **options: Any) -> Library:
        library = Library(*arguments, **options)
        monkeypatch.setattr(opencv_camera, "_library", lambda: library)
        return library

    return plug


def test_depth_and_colours_of_openni(plug: Any) -> None:
    def holed(i: int) -> np.ndarray:
        depth = np.full((HEIGHT, WIDTH), 700 - i, np.uint16)
        depth[0], depth[1] = 0, 65535
        return depth

    library = plug(grabs(4, holed))
    with OpenCVCamera() as camera:
        # OpenNI's focal length is of images 640 pixels wide.
        assert camera.camera == nacre.Camera(WIDTH, HEIGHT, 57.5, 57.5, 31.5, 23.5)
        assert (camera.name, camera.serial, camera.depth_scale) == ("OpenNI 2 camera", "0", 1000)
        assert library.settings == {
            library.CAP_PROP_OPENNI2_MIRROR: 0, library.CAP_OPENNI_DEPTH_GENERATOR_REGISTRATION: 1
        }  # fmt: skip
        frames = list(islice(camera, 3))
    assert not library.is_open
    for i, frame in enumerate(frames):
        assert frame.index == i
        assert np.isnan(frame.depth[:2]).all()
        np.testing.assert_allclose(frame.depth[2:], 0.699 - 0.001 * i, rtol=1e-6)  # one image told the size
        assert frame.color is not None
        assert frame.color[5, 5].tolist() == [200, 10, 9]
    stamps = [frame.timestamp for frame in frames]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("is_old", [False, True])
def test_an_orbbec_tells_its_lens_and_gives_depth_and_colours_apart(
    is_old: bool, plug: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opencv_camera, "_MAX_DIFFERENCE", 0 if is_old else 60)
    depth, colors = grabs(1)[0]
    plug([None, (depth, None), None, (None, colors), (depth, None)], plugged=((ORBBEC, 2),), focal=50.0)
    with OpenCVCamera(2, driver="orbbec") as camera:
        assert camera.camera == nacre.Camera(WIDTH, HEIGHT, 50, 50, 30, 25)
        frame = next(iter(camera))
    assert (frame.color is None) == is_old
    if frame.color is not None:
        assert frame.color[0, 0].tolist() == [200, 10, 9]


def test_without_colour(plug: Any) -> None:
    library = plug(grabs(2))
    with OpenCVCamera(color=False) as camera:
        assert next(iter(camera)).color is None
    assert library.settings[library.CAP_OPENNI_DEPTH_GENERATOR_REGISTRATION] == 0


def test_the_first_driver_that_finds_the_camera(plug: Any) -> None:
    plug(grabs(1), plugged=((ASUS, 1), (ORBBEC, 1)))
    assert OpenCVCamera(1).name == "OpenNI 2 camera"
    plug(grabs(1), built=(ORBBEC,), plugged=((OPENNI, 0), (ORBBEC, 0)))
    assert OpenCVCamera().name == "Orbbec camera"


def test_colours_of_another_size_are_left_out(plug: Any) -> None:
    small = np.zeros((24, 32, 3), np.uint8)
    plug([(depth, small) for depth, _ in grabs(4)])
    message = "^colours are left out: the images are 32 x 24, and the depth images 64 x 48$"
    with OpenCVCamera() as camera, pytest.warns(UserWarning, match=message) as told:
        assert [frame.color for frame in islice(camera, 3)] == [None] * 3
    assert len(told) == 1


@pytest.mark.parametrize(
    ("options", "driver", "message"),
    [
        ({"plugged": ()}, "openni", "no OpenNI 2 camera 0 was found: plug it in"),
        ({"plugged": ()}, None, "no OpenNI 2 or Orbbec camera 0 was found"),
        ({"grabs": []}, None, r"OpenNI 2 camera 0 gave no depth image for 0\.05 s"),
        ({"grabs": [(None, np.zeros((2, 2, 3), np.uint8))]}, None, r"gave no depth image for 0\.05 s"),
        ({"grabs": grabs(1), "focal": 0.0}, None, "does not tell its focal length, but 0"),
        ({"grabs": grabs(1), "focal": float("nan")}, None, "does not tell its focal length, but nan"),
        ({"grabs": [(np.zeros((4, 4), np.uint8), None)]}, None, "of 16 bits, but gave uint8, 4 x 4"),
        ({"grabs": [(np.zeros((4, 4, 3), np.uint16), None)]}, None, "but gave uint16, 4 x 4 x 3"),
        ({"grabs": [Error("no device")]}, None, "OpenNI 2 camera 0 stopped: no device"),
    ],
)
def test_what_cannot_be_used(options: Any, driver: str | None, message: str, plug: Any) -> None:
    library = plug(**options)
    with pytest.raises(nacre.CameraError, match=message):
        OpenCVCamera(driver=driver, timeout=0.05)
    assert not library.is_open


@pytest.mark.parametrize(
    ("later", "message"),
    [
        ([], r"gave no depth image for 0\.05 s: plug it in again"),
        ([Error("gone")], "stopped: gone"),
        ([OTHER], "gave an image of 32 x 24 after those of 64 x 48"),
    ],
)
def test_it_ends_with_an_error_after_what_came(later: list[Any], message: str, plug: Any) -> None:
    plug([FIRST, FIRST, *later])
    with OpenCVCamera(timeout=0.05) as camera:
        frames = iter(camera)
        assert next(frames).index == 0
        with pytest.raises(nacre.CameraError, match=message):
            next(frames)


def test_closing_ends_it(plug: Any) -> None:
    plug(grabs(9))
    camera = OpenCVCamera()
    frames = iter(camera)
    next(frames)
    camera.close()
    camera.close()
    assert list(frames) == []


def test_what_was_built_without_the_driver(plug: Any) -> None:
    plug(built=())
    with pytest.raises(ImportError, match=r"has no driver of OpenNI 2, .* -D WITH_OPENNI2=ON$"):
        OpenCVCamera(driver="openni")
    with pytest.raises(ImportError, match="-D WITH_OPENNI2=ON or -D WITH_OBSENSOR=ON"):
        OpenCVCamera()


def test_misuse(plug: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="driver must be 'openni' or 'orbbec', got 'kinect'"):
        OpenCVCamera(driver="kinect")
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(ImportError, match=r"need OpenCV's cv2, built with -D WITH_OPENNI2=ON"):
        OpenCVCamera()


def test_the_command(plug: Any, tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    from command_line import run

    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    plug(grabs(8, lambda i: (700 - i + 30 * np.sin(x / 6) * np.cos(y / 7)).astype(np.uint16)))
    out = tmp_path / "out"
    quick = ("--no-window", "--no-report", "--last", 5, "--set", "binning=1")
    done = run("record", "openni", "-o", out, *quick)
    assert done.code == 0, done.err
    assert "OpenNI 2 camera 0: live" in done.out
    kept = nacre.open_sequence(out / "recording")
    assert len(kept) == 6
    assert kept.has_color
    assert run("record", "openni:left", "-o", out).code == 2
    plug(plugged=())
    assert "no Orbbec camera 3 was found" in run("info", "orbbec:3").err
