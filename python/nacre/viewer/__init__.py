"""
The model in the browser while it grows, and afterwards; needs ``pip install "nacre[view]"`` (viser).

:class:`Viewer` is the page; :class:`Story` is what it tells: the frames, and the model after some of them.
"""

from nacre.viewer.live import LiveView
from nacre.viewer.page import Viewer, export_html
from nacre.viewer.rerun_file import export_rrd
from nacre.viewer.story import Moment, Snapshot, Story
from nacre.viewer.written import written_story

__all__ = ["LiveView", "Moment", "Snapshot", "Story", "Viewer", "export_html", "export_rrd", "written_story"]
