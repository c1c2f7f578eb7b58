"""
The model in the browser while it grows, and afterwards; needs ``pip install "nacre[view]"`` (viser).

:class:`Viewer` is the page; :class:`Timeline` what it shows: the frames, and the model after some of them.
"""

from nacre.viewer.live import LiveView
from nacre.viewer.page import Viewer, export_html
from nacre.viewer.rerun_file import export_rrd
from nacre.viewer.saved_timeline import read_timeline
from nacre.viewer.timeline import Snapshot, Timeline

__all__ = [
    "LiveView",
    "ReportedFrame",
    "Snapshot",
    "Timeline",
    "Viewer",
    "export_html",
    "export_rrd",
    "read_timeline",
]
