"""Triangles over a model, for those who need them; the points stay the product."""

from __future__ import annotations

from nacre.meshing.boundary import boundary_loops
from nacre.meshing.closed_surface import ClosedSurface, close_surface
from nacre.meshing.parts import largest_part, part_sizes
from nacre.meshing.simplification import simplify
from nacre.meshing.surface_points import on_surface
from nacre.meshing.texture_views import TextureView, texture_views
from nacre.meshing.texturing import texture_mesh
from nacre.meshing.triangulation import mesh_points, triangulate, used_rows
from nacre.texture import Texture

__all__ = [
    "ClosedSurface",
    "Texture",
    "TextureView",
    "boundary_loops",
    "close_surface",
    "largest_part",
    "mesh_points",
    "on_surface",
    "part_sizes",
    "simplify",
    "texture_mesh",
    "texture_views",
    "triangulate",
    "used_rows",
]
