"""What other libraries, and notebooks, get of a model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal.array_of_points import ArrayOfPoints
from nacre._internal.guided import guided

if TYPE_CHECKING:
    from nacre.io.cloud import Cloud
    from nacre.mesh import Mesh


_CLOSED = "nacre.meshing.close_surface(cloud.points, cloud.normals) does, of cloud = model.cloud()"
_FEWER = "nacre.meshing.simplify(mesh.vertices, mesh.triangles, num_triangles) does, of a mesh"


class ExchangeablePoints(ArrayOfPoints, ABC):
    """Gives points to other libraries, which are imported when they are asked for."""

    @property
    @abstractmethod
    def points(self) -> npt.NDArray[np.float32]:
        """(N, 3) [m]."""

    @property
    @abstractmethod
    def normals(self) -> npt.NDArray[np.float32]:
        """(N, 3) unit vectors."""

    @property
    @abstractmethod
    def colors(self) -> npt.NDArray[np.uint8] | None:
        """(N, 3), or None."""

    @abstractmethod
    def cloud(self, *, all_points: bool = False) -> Cloud:
        """Return the points that are a surface."""

    @guided(closed=_CLOSED, watertight=_CLOSED, simplify=_FEWER, num_triangles=_FEWER)
    def to_mesh(self, *, num_threads: int = 0) -> Mesh:
        """
        Return triangles that join the points of :meth:`cloud`; see :func:`nacre.meshing.triangulate`.

        Its vertices are points of the model, with their normals, and their colours where there are any.

        Parameters
        ----------
        num_threads : int
            0 uses all.

        Raises
        ------
        ValueError
            When there are too few points for a surface.
        """
        from nacre.meshing import mesh_points

        cloud = self.cloud()
        assert cloud.normals is not None
        return mesh_points(cloud.points, cloud.normals, colors=cloud.colors, num_threads=num_threads)

    def to_open3d(self) -> Any:
        """
        Return the points as an ``open3d.geometry.PointCloud``, with normals, and colours where there are any.

        Raises
        ------
        ImportError
            When Open3D is missing, with the command that installs it.
        """
        try:
            from open3d import geometry, utility
        except ImportError as error:
            raise ImportError("to_open3d needs Open3D: pip install open3d") from error
        cloud = geometry.PointCloud(utility.Vector3dVector(self.points.astype(np.float64)))
        cloud.normals = utility.Vector3dVector(self.normals.astype(np.float64))
        if self.colors is not None:
            cloud.colors = utility.Vector3dVector(self.colors / 255.0)
        return cloud

    def to_trimesh(self) -> Any:
        """
        Return the points as a ``trimesh.PointCloud``, with colours where there are any.

        It has no place for normals: they are in its ``metadata["normals"]``. With triangles it is
        ``trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_colors=mesh.colors)``, of the mesh of
        :meth:`to_mesh`.

        Raises
        ------
        ImportError
            When trimesh is missing, with the command that installs it.
        """
        try:
            import trimesh
        except ImportError as error:
            raise ImportError("to_trimesh needs trimesh: pip install trimesh") from error
        return trimesh.PointCloud(self.points, colors=self.colors, metadata={"normals": self.normals})

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """Return a copy of the points (N, 3)."""
        if copy is False:
            raise ValueError("copy must be True or None: the points of a model are always copied, got False")
        return super().__array__(dtype)

    def _repr_png_(self) -> bytes | None:
        """Return a picture of the points, which notebooks show in place of the words of ``repr``."""
        from nacre.pictures.notebook import picture_of_points

        return picture_of_points(self.points, self.normals, self.colors)
