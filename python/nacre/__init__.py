"""nacre grows a 3D model from depth-camera images, layer by layer."""

from nacre._core import Camera, __version__

__all__ = ["Camera", "__version__"]
