"""nacre grows a 3D model from depth-camera images, layer by layer."""

from nacre._core import Camera, __version__
from nacre.consolidation import Consolidated, consolidate, project_samples

__all__ = ["Camera", "Consolidated", "__version__", "consolidate", "project_samples"]
