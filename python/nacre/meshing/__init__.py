"""Triangles over a model, for those who need them; the points stay the product."""

from __future__ import annotations

from nacre.meshing.closed_surface import ClosedSurface, close_surface
from nacre.meshing.parts import largest_part
from nacre.meshing.simplification import simplify
from nacre.meshing.surface_points import on_surface
from nacre.meshing.triangulation import mesh_points, triangulate, used_rows

__all__ = [
    "ClosedSurface",
    "close_surface",
    "largest_part",
    "mesh_points",
    "on_surface",
    "simplify",
    "triangulate",
    "used_rows",
]
