"""Pictures of models, and a page that shows what a reconstruction gave."""

from nacre.report.data import DepthExample, ModelCloud, ReportData
from nacre.report.html import render_page, write_report
from nacre.report.png import encode_png
from nacre.report.render import render_points
from nacre.report.reported_frame import ReportedFrame
from nacre.report.view import View

__all__ = [
    "DepthExample",
    "ModelCloud",
    "ReportData",
    "ReportedFrame",
    "View",
    "encode_png",
    "render_page",
    "render_points",
    "write_report",
]
