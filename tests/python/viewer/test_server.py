"""The server of the page."""

from __future__ import annotations

import json
import socket
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.client import HTTPResponse
from pathlib import Path

import numpy as np
import pytest

from nacre.report import ReportedFrame
from nacre.viewer import Viewer

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import plane, two_looks


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    timeline = two_looks(plane())
    timeline.depth_of = lambda index: np.full((100, 100), 1.0 + index, np.float32)
    viewer = Viewer(timeline, port=0)
    yield viewer
    viewer.close()


def ask(viewer: Viewer, path: str, **headers: str) -> HTTPResponse:
    answer: HTTPResponse = urllib.request.urlopen(urllib.request.Request(viewer.url + path, headers=headers))
    with answer:
        answer.body = answer.read()  # type: ignore[attr-defined]
    return answer


def refused(viewer: Viewer, path: str, **headers: str) -> int:
    with pytest.raises(urllib.error.HTTPError) as error:
        ask(viewer, path, **headers)
    error.value.close()
    return error.value.code


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
