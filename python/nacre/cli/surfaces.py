"""Measuring a model against a surface."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.terminal import CommandError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from nacre import Mesh
    from nacre.evaluation import SurfaceSamples
    from nacre.evaluation.result import Result

    Array = npt.NDArray[Any]


def mesh_suffixes() -> tuple[str, ...]:
    """Return the endings of files that may hold a mesh."""
    from nacre.io.meshes import READ_SUFFIXES

    return READ_SUFFIXES


def point_suffixes() -> tuple[str, ...]:
    """Return the endings of point files."""
    from nacre.io.points import SUFFIXES

    return SUFFIXES


def transformed(pose: Array, points: Array, normals: Array | None) -> tuple[Array, Array | None]:
    """Return points and normals in another frame, as float64."""
    rotation = pose[:3, :3].T
    return points @ rotation + pose[:3, 3], None if normals is None else normals @ rotation


def evaluate_surface(
    points: Array,
    normals: Array | None,
    reference: Mesh | Array,
    reference_normals: Array | None = None,
    *,
    tau: Sequence[float],
    samples: SurfaceSamples | None = None,
    seen: npt.NDArray[np.bool_] | None = None,
) -> dict[str, Result]:
    """Return every figure of a model against a mesh or a cloud, by name."""
    from nacre import KdTree, Mesh, evaluation

    surface = reference if samples is None else samples.points
    accuracy = evaluation.surface_accuracy(points, reference, reference_normals=reference_normals)
    covered = evaluation.completeness(points, surface, tau=tau, seen=seen)
    precision = tuple(float((accuracy.distances <= t).mean()) for t in covered.tau)
    pairs = zip(precision, covered.fraction, strict=True)
    results: dict[str, Result] = {
        "surface_accuracy": accuracy,
        "completeness": covered,
        "f_score": evaluation.FScore(
            covered.tau,
            precision,
            covered.fraction,
            tuple(2 * p * r / (p + r) if p + r else 0.0 for p, r in pairs),
        ),
        "uniformity": evaluation.uniformity(points),
    }
    if normals is not None:
        if isinstance(reference, Mesh):
            results["normal_error"] = evaluation.normal_error(normals, reference.closest(points).normals)
        elif reference_normals is not None:
            nearest = KdTree(reference).query(points, k=1)[1]
            results["normal_error"] = evaluation.normal_error(normals, reference_normals[nearest])
    return results


def read_surface(path: Path, scale: float = 1.0) -> tuple[Mesh | Array, Array | None]:
    """Read a mesh, or a point file with its normals."""
    import nacre

    suffix = path.suffix.lower()
    if suffix not in mesh_suffixes() + point_suffixes():
        known = ", ".join(dict.fromkeys(mesh_suffixes() + point_suffixes()))
        raise CommandError(f"{path}: a surface is a mesh or a point file ({known})", 2)
    if suffix in mesh_suffixes() and has_faces(path):
        mesh = nacre.read_mesh(path)
        return (mesh if scale == 1 else nacre.Mesh(scale * mesh.vertices, mesh.triangles)), None
    cloud = nacre.read_points(path)
    return scale * cloud.points, cloud.normals


def has_faces(path: Path) -> bool:
    """Return whether a file that may hold a mesh does."""
    if path.suffix.lower() != ".ply":
        return True
    from nacre.io.ply_header import read_header
    from nacre.io.raw import read_file

    header = read_header(path, read_file(path))
    return any(element.name == "face" and element.num_rows > 0 for element in header.elements)
