"""nacre grows a 3D model from depth-camera images, layer by layer."""

from nacre._core import Camera, __version__
from nacre.errors import FileFormatError
from nacre.io.cloud import Cloud
from nacre.io.meshes import read_mesh, write_mesh
from nacre.io.points import read_points, write_points

__all__ = [
    "Camera",
    "Cloud",
    "FileFormatError",
    "__version__",
    "read_mesh",
    "read_points",
    "write_mesh",
    "write_points",
]
