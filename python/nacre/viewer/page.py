"""The page: the scene with its controls, served to a browser; and a file that shows it without a server."""

from __future__ import annotations

import io
import os
import threading
from contextlib import redirect_stdout
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import back_project, preprocess_depth
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer
from nacre.parameters import DepthParameters
from nacre.report.reported_frame import ReportedFrame
from nacre.viewer.colors import STATUS_COLORS, color_kinds, color_range
from nacre.viewer.depth_picture import depth_legend, depth_picture
from nacre.viewer.scene import Scene, core, extent
from nacre.viewer.timeline import Snapshot, Timeline, words

_MISSING = 'the viewer needs viser: pip install "nacre[view]"'


class Viewer:
    """
    Shows a timeline in the browser.

    Parameters
    ----------
    timeline : Timeline
        May grow while it is shown; call :meth:`refresh` then.
    host, port : str, int
        Where to listen; another port is taken where this one is in use.
    parameters : DepthParameters, optional
        What is marked as removed in depth images.

    Raises
    ------
    ImportError
        When viser is missing, with the command that installs it.
    """

    def __init__(
        self,
        timeline: Timeline,
        *,
        host: str = "127.0.0.1",
        port: int = 8080,
        parameters: DepthParameters | None = None,
    ) -> None:
        self.timeline = timeline
        self._parameters = parameters
        self._server = _server(host, port)
        self._scene = Scene(self._server.scene, timeline.camera)
        self._lock = threading.RLock()
        self._size = 0.0
        self._shown: tuple[Snapshot, str, float] | None = None
        self._is_moving = False  # the slider, by this class and not by a person
        self._build()
        self.refresh()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{self._server.get_host()}:{self._server.get_port()}"

    @property
    def place(self) -> int:
        """Which frame is shown, as a place in the timeline's list."""
        return min(int(self._time.value), len(self.timeline.frames) - 1)

    def refresh(self) -> None:
        """Show what the timeline has gained; the newest frame, unless a person has chosen another one."""
        with self._lock:
            last = max(len(self.timeline.frames) - 1, 0)
            self._time.max = max(last, 1)
            if self._follow.value and self._time.value != last:
                self._is_moving = True
                self._time.value = last
                self._is_moving = False
            self._strip.content = status_strip(self.timeline.frames)
            self._draw()

    def wait(self) -> None:
        """Serve until Ctrl-C."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return

    def close(self) -> None:
        """Stop serving."""
        _stop(self._server)

    def _build(self) -> None:
        gui = self._server.gui
        gui.configure_theme(show_share_button=False, dark_mode=True)
        gui.main_panel.dock_right()
        self._title = gui.add_markdown(f"## {self.timeline.title}")
        self._summary = gui.add_markdown("")
        self._picture = gui.add_image(np.full((3, 4, 3), 24, np.uint8), label="Depth", format="png")
        gui.add_html(depth_legend())
        self._time = gui.add_slider("frame", min=0, max=1, step=1, initial_value=0)
        self._strip = gui.add_html("")
        self._follow = gui.add_checkbox("follow the newest", True)
        self._figures = gui.add_markdown("")
        with gui.add_folder("Look"):
            self._kind = gui.add_dropdown("colour by", ("shading",), initial_value="shading")
            self._legend = gui.add_html("")
            self._point_size = gui.add_slider("point size", min=0.2, max=4.0, step=0.1, initial_value=1.4)
            self._own_points = gui.add_checkbox("points of this frame", False)
        self._time.on_update(self._on_time)
        for control in (self._kind, self._point_size, self._own_points, self._follow):
            control.on_update(lambda _: self.refresh())

    def _on_time(self, _: Any) -> None:
        if self._is_moving:
            return
        with self._lock:
            self._follow.value = self.place == len(self.timeline.frames) - 1
            self._draw()

    def _draw(self) -> None:
        """Draw the frame that is chosen."""
        if not self.timeline.frames:
            return
        place = self.place
        frame = self.timeline.frames[place]
        with self._server.atomic():
            cloud = self.timeline.snapshot_at(place)
            if cloud is not None and len(cloud.points):
                self._show_cloud(cloud)
            if self._size:
                self._scene.show_cameras(self.timeline, place, 0.12 * self._size)
            self._figures.content = figures_table(frame)
            self._summary.content = summary(self.timeline)
            self._show_depth(frame)

    def _show_cloud(self, cloud: Snapshot) -> None:
        kinds = color_kinds(cloud)
        if tuple(self._kind.options) != kinds:
            self._kind.options = kinds
            self._kind.value = kinds[0]
        wanted = (cloud, self._kind.value, self._point_size.value)
        if self._shown != wanted:
            self._shown = wanted
            self._scene.show_cloud(*wanted)
            self._legend.content = color_bar(cloud, self._kind.value)
        if not self._size:
            self._size = extent(cloud)
            look_at(self._server.initial_camera, cloud, self._size)

    def _show_depth(self, frame: ReportedFrame) -> None:
        depth = self._depth(frame)
        self._picture.visible = depth is not None
        if depth is None or self.timeline.camera is None:
            return
        self._picture.image = depth_picture(depth, self.timeline.camera, self._parameters)
        wanted = self._own_points.value and frame.world_from_camera is not None
        points = np.zeros((0, 3), np.float32)
        if wanted and frame.world_from_camera is not None:
            clean = preprocess_depth(depth, self.timeline.camera)
            pose = frame.world_from_camera.astype(np.float32)
            points = back_project(clean, self.timeline.camera) @ pose[:3, :3].T + pose[:3, 3]
        spacing = self._shown[0].spacing if self._shown else 0.001
        self._scene.show_points(points, 0.6 * spacing, bool(len(points)))

    def _depth(self, frame: ReportedFrame) -> npt.NDArray[np.float32] | None:
        if self.timeline.depth_of is None:
            return None
        try:
            return self.timeline.depth_of(frame.index)
        except (FileFormatError, OSError):
            return None


def look_at(camera: Any, cloud: Snapshot, size: float) -> None:
    """Put the browser's camera above and beside the first depth camera, so that it sees the whole model."""
    middle = np.median(core(cloud), axis=0).astype(np.float64)
    camera.look_at = middle
    camera.position = middle + size * np.array([-0.45, -0.45, -1.0])
    camera.up = (0.0, -1.0, 0.0)


def summary(timeline: Timeline) -> str:
    """Return in a line how many frames there are of each status."""
    counts = {status: sum(frame.status == status for frame in timeline.frames) for status in STATUS_COLORS}
    parts = [f"{number} {status}" for status, number in counts.items() if number]
    return f"{len(timeline.frames)} frames: {', '.join(parts)}"


def color_bar(cloud: Snapshot, kind: str) -> str:
    """Return what the colours of the points mean: their range, or how they come about."""
    words = {
        "colour": "as the camera saw it",
        "shading": "lit from the first camera",
        "normal": "red: to the right, green: up, blue: towards the first camera",
    }
    low, high = color_range(cloud, kind)
    bar = "linear-gradient(90deg,#440154,#3b518b,#21908d,#5cc863,#fde725)"
    told = words.get(kind) or (
        f'<span>{low}</span><span style="flex:1;height:9px;background:{bar}"></span><span>{high}</span>'
    )
    return (
        f'<div style="display:flex;gap:8px;align-items:center;font-size:12px;padding:2px 14px">{told}</div>'
    )


def figures_table(frame: ReportedFrame) -> str:
    """Return what is known of a frame as Markdown."""
    reason = f": {frame.reason}" if frame.reason else ""
    rows = "".join(f"\n| {name} | {value} |" for name, value in words(frame).items())
    table = f"\n\n| | |\n|---|---|{rows}" if rows else ""
    return f"**frame {frame.index}, {frame.status}**{reason}{table}"


def status_strip(frames: list[ReportedFrame], width: int = 1000) -> str:
    """Return a bar of all frames in the colours of their statuses, for the time line."""
    if not frames:
        return ""
    step = width / len(frames)
    bars, start = [], 0
    for end in range(1, len(frames) + 1):
        if end == len(frames) or frames[end].status != frames[start].status:
            color = "rgb({},{},{})".format(*STATUS_COLORS[frames[start].status])
            bars.append(
                f'<rect x="{start * step:.1f}" width="{(end - start) * step:.1f}" height="20" fill="{color}">'
                f"<title>{escape(frames[start].status)}</title></rect>"
            )
            start = end
    return (
        f'<svg viewBox="0 0 {width} 20" preserveAspectRatio="none" '
        f'style="width:calc(100% - 28px);height:8px;margin:2px 14px;display:block">{"".join(bars)}</svg>'
    )


def export_html(timeline: Timeline, path: str | os.PathLike[str], *, seconds: float = 8.0) -> None:
    """
    Write a page that opens from disk: the model grows as it did, over some seconds.

    Parameters
    ----------
    timeline : Timeline
        At least one state of the model.
    path : path-like
        The file, usually ``view.html``; it appears when it is complete.
    seconds : float
        How long it takes.

    Raises
    ------
    ImportError
        When viser is missing.
    ValueError
        When the timeline has no model.
    """
    states = timeline.snapshots
    if not states:
        raise ValueError("timeline must hold a state of the model to export, got none")
    server = _server("127.0.0.1", 0)
    try:
        serializer = server.get_scene_serializer()
        scene = Scene(server.scene, timeline.camera)
        last = states[-1][1]
        size, kind = extent(last), color_kinds(last)[0]
        look_at(server.initial_camera, last, size)
        for place, cloud in states:
            scene.show_cloud(cloud, kind if kind in color_kinds(cloud) else "shading")
            scene.show_cameras(timeline, place, 0.12 * size)
            if len(states) > 1:
                serializer.insert_sleep(seconds / len(states))
        page = serializer.as_html(dark_mode=True)
    finally:
        _stop(server)
    with atomic_writer(Path(path)) as stream:
        stream.write(page.encode())


def _server(host: str, port: int) -> Any:
    try:
        import viser
    except ImportError as error:
        raise ImportError(_MISSING) from error
    with redirect_stdout(io.StringIO()):  # its banner
        return viser.ViserServer(host=host, port=port, verbose=False)


def _stop(server: Any) -> None:
    with redirect_stdout(io.StringIO()):
        server.stop()
