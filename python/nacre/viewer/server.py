"""Serving the page to a browser, on this machine alone unless told otherwise."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from nacre._internal.kinds import as_kind
from nacre.errors import FileFormatError, printable
from nacre.parameters import DepthParameters
from nacre.viewer.controls import Controls
from nacre.viewer.page import page_html
from nacre.viewer.page_data import PageData
from nacre.viewer.timeline import Timeline

_PORTS_TRIED = 100


class Viewer:
    """
    Shows a timeline in the browser.

    Parameters
    ----------
    timeline : Timeline
        May grow while it is shown; call :meth:`refresh` then.
    other : Timeline, optional
        Another run of the same scene, in the same world frame (:func:`in_frame_of`), to compare with.
    host, port : str, int
        Where to listen; another port is taken where this one is in use, any free one for 0.
    parameters : DepthParameters, optional
        What is marked as removed in depth images.
    controls : Controls, optional
        Of a camera that runs: the page shows what it sees, and buttons.

    Raises
    ------
    OSError
        When no port is free.
    ValueError
        When the other run has no model.
    """

    def __init__(
        self,
        timeline: Timeline,
        *,
        other: Timeline | None = None,
        host: str = "127.0.0.1",
        port: int = 8080,
        parameters: DepthParameters | None = None,
        controls: Controls | None = None,
    ) -> None:
        self.timeline = timeline
        self.controls = controls
        as_kind("timeline", timeline, Timeline, "a nacre.viewer.Timeline")
        self._timelines: Sequence[Timeline] = [timeline] if other is None else [timeline, other]
        self._parameters = parameters
        self.revision = 0
        self.refresh()
        self._server = _listen(host, port)
        self._server.viewer = self
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Where the page is."""
        host, port = self._server.server_address[:2]
        return f"http://{host!s}:{port}"

    def refresh(self) -> None:
        """Show what the timeline has gained."""
        self.data = PageData(self._timelines, self._parameters, is_live=self.controls is not None)
        self.data.prepare()
        self.revision += 1

    def read(self, name: str) -> tuple[str, bytes]:
        """
        Return what a name of the page's data stands for: its type, and its bytes.

        Raises
        ------
        KeyError
            When there is nothing.
        """
        kind, _, rest = name.partition("/")
        if self.controls is None or kind not in ("live", "picture"):
            return "application/octet-stream", self.data.read(name)
        if kind == "live":
            return "application/json", json.dumps(self._live(self.controls)).encode()
        image = self.controls.picture(rest, self._parameters)
        return "image/jpeg" if rest == "color" else "image/png", image

    def _live(self, controls: Controls) -> dict[str, Any]:
        """Return what changes from frame to frame."""
        frames = self.timeline.frames
        newest = frames[-1] if frames else None
        return controls.as_dict() | {
            "status": newest and newest.status,
            "reason": newest and newest.reason,
            "numFrames": len(frames),
        }

    def wait(self) -> None:
        """Serve until Ctrl-C."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = False
    viewer: Viewer

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away while it was answered."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers ``/`` with the page, ``/data/NAME`` with what it reads; ``/press/NAME`` is a button."""

    server: _Server
    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        if not self._is_asked_by_its_name():
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        url = urlsplit(self.path)
        viewer = self.server.viewer
        known = parse_qs(url.query).get("known")
        if url.path == "/":
            self._answer("text/html; charset=utf-8", page_html(viewer.timeline.title).encode())
        elif url.path == "/data/document" and known == [str(viewer.revision)]:
            self.send_response(HTTPStatus.NO_CONTENT)
            self.end_headers()
        elif url.path.startswith("/data/"):
            try:
                self._answer(*viewer.read(url.path.removeprefix("/data/")))
            except KeyError:
                self.send_error(HTTPStatus.NOT_FOUND)
            except (FileFormatError, OSError) as error:
                self._say_damaged(error)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Press a button; only the page itself may: other pages have another origin."""
        self.close_connection = True  # of what comes along nothing is read
        controls = self.server.viewer.controls
        button = self.path.removeprefix("/press/")
        is_own = self.headers.get("Origin") == f"http://{self.headers.get('Host')}"
        if not (is_own and self._is_asked_by_its_name()):
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        try:
            if controls is None:
                raise KeyError(button)
            controls.press(button)
        except KeyError:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        self.send_response(HTTPStatus.NO_CONTENT)
        self.end_headers()

    def _is_asked_by_its_name(self) -> bool:
        """Refuse pages of others, which reach this server under a name of theirs (DNS rebinding)."""
        host, port = self.server.server_address[:2]
        if host in ("0.0.0.0", "::"):
            return True
        return self.headers.get("Host") in (f"{host!s}:{port}", f"localhost:{port}")

    def _answer(self, kind: str, body: bytes) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("ETag", str(self.server.viewer.revision))
        self.end_headers()
        self.wfile.write(body)

    def _say_damaged(self, error: Exception) -> None:
        """Answer that a file has not what it should have; a connection that broke is no such thing."""
        if isinstance(error, ConnectionError):
            raise error
        self.send_error(HTTPStatus.NOT_FOUND, explain=printable(str(error)))

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: the terminal belongs to the run."""


def _listen(host: str, port: int) -> _Server:
    last = port if port == 0 else min(port + _PORTS_TRIED, 65535)
    for candidate in range(port, last + 1):
        try:
            return _Server((host, candidate), _Handler)
        except OSError:
            if candidate == last:
                raise
    raise AssertionError("unreachable")
