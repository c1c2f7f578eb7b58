"""Pictures of models, and a page that shows what a reconstruction gave."""

from nacre.pictures.image_files import encode_png
from nacre.rendering import View, render_points
from nacre.report.data import DepthExample, ModelCloud, ReportData
from nacre.report.doubled_surfaces import DoubledSurfaces
from nacre.report.page import render_page, write_report
from nacre.run_data.reported_frame import ReportedFrame

__all__ = [
    "DepthExample",
    "DoubledSurfaces",
    "ModelCloud",
    "ReportData",
    "ReportedFrame",
    "View",
    "encode_png",
    "render_page",
    "render_points",
    "write_report",
]
