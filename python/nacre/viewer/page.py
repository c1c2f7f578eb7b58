"""The page: one HTML file, whose data are in it or come from a server."""

from __future__ import annotations

import base64
import gzip
import os
from collections.abc import Iterator
from html import escape
from pathlib import Path

from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.io.atomic import atomic_writer
from nacre.viewer.packing import pack_files
from nacre.viewer.page_data import PageData
from nacre.viewer.timeline import Timeline

_WEB = Path(__file__).with_name("web")
_SCRIPTS = (
    "linear.js", "data.js", "cloud.js", "frustum.js", "disk_sizes.js", "octree.js", "orbit.js", "renderer.js",
    "cameras.js", "picking.js", "measure.js", "crop.js", "deviation.js", "holes.js", "player.js", "live.js",
    "panel.js", "main.js",
)  # fmt: skip


def page_html(title: str, data: bytes = b"") -> str:
    """
    Return the page.

    Parameters
    ----------
    title : str
        Of the page.
    data : bytes
        What :func:`nacre.viewer.packing.pack_files` returns; none: the page asks its server.
    """
    page = (_WEB / "page.html").read_text(encoding="utf-8")
    scripts = "\n".join((_WEB / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    embedded = base64.b64encode(gzip.compress(data, 6, mtime=0)).decode() if data else ""
    parts = {
        "title": escape(title),
        "style": (_WEB / "style.css").read_text(encoding="utf-8"),
        "data": embedded,
        "scripts": scripts,
    }
    for name, part in parts.items():
        page = page.replace(f"<!-- {name} -->", part, 1)
    return page


@guided("nacre.viewer.read_timeline(folder) has the timeline of a run")
def export_html(
    timeline: Timeline,
    path: str | os.PathLike[str],
    *,
    other: Timeline | None = None,
    triangles: bool = True,
) -> None:
    """
    Write a page that opens from disk, with every tool of the viewer but depth images.

    Parameters
    ----------
    timeline : Timeline
        At least one state of the model.
    path : path-like
        The file, usually ``view.html``; it appears when it is complete.
    other : Timeline, optional
        Another run of the same scene, in the same world frame (:func:`in_frame_of`), to compare with.
    triangles : bool
        Whether the page can show a mesh, and holes; without, it is smaller.

    Raises
    ------
    ValueError
        When a timeline has no model.

    Notes
    -----
    Positions are rounded to 1 / 65535 of the model's longest side, confidence and standard deviations to
    0.02 %, and of more than a million points, or four million corners of a mesh, every second, third, ... is
    kept: as points, which the page joins by triangles of its own.
    """
    as_kind("timeline", timeline, Timeline, "a nacre.viewer.Timeline")
    if not timeline.has_points:
        raise ValueError("timeline must hold a state of the model to export, got none")
    data = PageData([timeline] if other is None else [timeline, other])
    names = data.names + (data.surface_names if triangles else [])
    page = page_html(timeline.title, pack_files((name, data.read(name)) for name in _by_state(names)))
    with atomic_writer(path) as stream:
        stream.write(page.encode())


def _by_state(names: list[str]) -> Iterator[str]:
    """Yield points and triangles of a state together, so that it is prepared once."""
    yield from sorted(names, key=lambda name: name.partition("/")[2])
