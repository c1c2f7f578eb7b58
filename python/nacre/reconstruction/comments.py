"""What the files of a run say about themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nacre.system import __version__

if TYPE_CHECKING:
    from nacre.reconstruction.reconstruction import Reconstruction


def file_comments(done: Reconstruction) -> list[str]:
    """Return lines for their headers: who wrote them, in which frame, and from where to look first."""
    from nacre.reconstruction.run_figures import run_report
    from nacre.report.first_view import viewers_view
    from nacre.viewer.timeline import CAMERA_FRAME

    comments = [f"nacre {__version__}", f"metres; {CAMERA_FRAME}"]
    told = run_report(done, "", "", interrupted=True)  # without what takes long
    if told.model is not None:
        comments.append(viewers_view(told.model, told.frames, told.camera).as_comment())
    return comments
