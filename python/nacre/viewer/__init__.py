"""
The model in the browser while it grows, and afterwards; in a page of its own or from a server.

:class:`Viewer` is the page; :class:`Timeline` what it shows: the frames, and the model after some of them.
"""

import importlib
from typing import TYPE_CHECKING, Any

from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline

if TYPE_CHECKING:
    from nacre.viewer.controls import Controls
    from nacre.viewer.live import LiveView
    from nacre.viewer.page import export_html
    from nacre.viewer.rerun_file import export_rrd
    from nacre.viewer.same_frame import in_frame_of
    from nacre.viewer.saved_timeline import read_timeline
    from nacre.viewer.server import Viewer

__all__ = [
    "Controls",
    "LiveView",
    "Snapshot",
    "Timeline",
    "Viewer",
    "export_html",
    "export_rrd",
    "in_frame_of",
    "read_timeline",
]

_SHOWING = {
    "Controls": "controls",
    "LiveView": "live",
    "Viewer": "server",
    "export_html": "page",
    "export_rrd": "rerun_file",
    "in_frame_of": "same_frame",
    "read_timeline": "saved_timeline",
}


def __getattr__(name: str) -> Any:
    """Import what shows a timeline only when it is asked for: reports need the timeline alone."""
    if name in _SHOWING:
        return getattr(importlib.import_module(f"nacre.viewer.{_SHOWING[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
