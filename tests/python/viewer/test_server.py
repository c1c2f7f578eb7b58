"""The server of the page."""

from __future__ import annotations

import json
import socket
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from nacre.datasets import SequenceFrame
from nacre.report import ReportedFrame
from nacre.viewer import Controls, Viewer

sys.path.insert(0, str(Path(__file__).parents[1]))
from asked_server import ask, refused
from viewer_scenes import CAMERA, plane, two_looks


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    timeline = two_looks(plane())
    timeline.depth_of = lambda index: np.full((100, 100), 1.0 + index, np.float32)
    viewer = Viewer(timeline, port=0)
    yield viewer
    viewer.close()


def test_it_serves_the_page_and_what_the_page_reads(viewer: Viewer) -> None:
    assert b"<title>plane</title>" in ask(viewer, "/").body
    document = json.loads(ask(viewer, "/data/document").body)
    assert [frame["status"] for frame in document["runs"][0]["frames"]] == ["TRACKED", "TRACKED"]
    name = document["runs"][0]["states"][-1]["name"]
    for kind in ("points", "triangles"):
        assert len(ask(viewer, f"/data/{kind}/{name}").body) > 1000
    pillow = pytest.importorskip("PIL")
    assert pillow
    assert ask(viewer, "/data/depth/1").body.startswith(b"\x89PNG")


@pytest.mark.parametrize("path", ["/etc", "/data/", "/data/points/0/0/0", "/data/depth/99", "/data/depth/x",
                                  "/data/depth/-1", "/data/../page.py", "/data/other/0/1/441"])  # fmt: skip
def test_there_is_nothing_else(viewer: Viewer, path: str) -> None:
    assert refused(viewer, path) == 404


def test_pages_of_others_are_refused(viewer: Viewer) -> None:
    assert refused(viewer, "/data/document", Host="evil.example") == 403
    port = viewer.url.rpartition(":")[2]
    assert ask(viewer, "/data/document", Host=f"localhost:{port}").status == 200


def test_a_document_that_is_known_is_not_sent_again(viewer: Viewer) -> None:
    known = ask(viewer, "/data/document").headers["ETag"]
    assert ask(viewer, f"/data/document?known={known}").status == 204
    viewer.timeline.add(ReportedFrame(2, "LOST", reason="no overlap"))
    viewer.refresh()
    answer = ask(viewer, f"/data/document?known={known}")
    assert json.loads(answer.body)["runs"][0]["frames"][-1]["reason"] == "no overlap"


class TestControls:
    @pytest.fixture
    def live(self) -> Iterator[Viewer]:
        viewer = Viewer(two_looks(plane()), port=0, controls=Controls())
        yield viewer
        viewer.close()

    def press(self, viewer: Viewer, button: str, **headers: str) -> int:
        request = urllib.request.Request(f"{viewer.url}/press/{button}", headers=headers, method="POST")
        try:
            with urllib.request.urlopen(request) as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            error.close()
            return error.code

    def test_the_page_presses_buttons(self, live: Viewer) -> None:
        assert json.loads(ask(live, "/data/document").body)["isLive"]
        assert self.press(live, "start", Origin=live.url) == 204
        told = json.loads(ask(live, "/data/live").body)
        assert (told["state"], told["status"], told["numFrames"]) == ("recording", "TRACKED", 2)
        assert self.press(live, "explode", Origin=live.url) == 404

    @pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
    def test_pages_of_others_cannot(self, live: Viewer, origin: str | None) -> None:
        headers = {} if origin is None else {"Origin": origin}
        assert self.press(live, "stop", **headers) == 403
        evil = {"Host": "evil.example", "Origin": "http://evil.example"}
        assert self.press(live, "stop", **evil) == 403
        assert live.controls is not None
        assert live.controls.state == "ready"

    def test_the_pictures(self, live: Viewer) -> None:
        pytest.importorskip("PIL")
        assert refused(live, "/data/picture/depth") == 404  # before the first frame
        assert live.controls is not None
        color = np.full((100, 100, 3), 90, np.uint8)
        live.controls.see(SequenceFrame(0, np.ones((100, 100), np.float32), CAMERA, None, color, None))
        assert ask(live, "/data/picture/depth").body.startswith(b"\x89PNG")
        assert ask(live, "/data/picture/color").headers["Content-Type"] == "image/jpeg"
        assert refused(live, "/data/picture/sound") == 404

    def test_a_run_without_a_camera_has_none(self, viewer: Viewer) -> None:
        assert refused(viewer, "/data/live") == 404
        assert self.press(viewer, "stop", Origin=viewer.url) == 404


def test_another_port_is_taken_where_one_is_in_use(viewer: Viewer) -> None:
    port = int(viewer.url.rpartition(":")[2])
    second = Viewer(two_looks(plane()), port=port)
    try:
        assert port < int(second.url.rpartition(":")[2]) <= port + 100
    finally:
        second.close()


def test_a_damaged_depth_image_is_not_there(viewer: Viewer) -> None:
    def broken(index: int) -> np.ndarray:
        raise OSError("gone")

    viewer.timeline.depth_of = broken
    assert refused(viewer, "/data/depth/0") == 404


def test_a_browser_that_goes_away_is_no_trouble(viewer: Viewer, capfd: pytest.CaptureFixture[str]) -> None:
    viewer.data.document = b" " * 50_000_000  # more than the system takes without being read
    port = int(viewer.url.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(f"GET /data/document HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n".encode())
        assert connection.recv(100).startswith(b"HTTP/1.1 200")
    assert ask(viewer, "/").status == 200
    assert capfd.readouterr().err == ""
