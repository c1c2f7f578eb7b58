"""
The model in the browser while it grows, and afterwards; in a page of its own or from a server.

:class:`Viewer` is the page; :class:`Timeline` what it shows: the frames, and the model after some of them.
"""

from nacre.viewer.controls import Controls
from nacre.viewer.live import LiveView
from nacre.viewer.page import export_html
from nacre.viewer.rerun_file import export_rrd
from nacre.viewer.same_frame import in_frame_of
from nacre.viewer.saved_timeline import read_timeline
from nacre.viewer.server import Viewer
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline

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
