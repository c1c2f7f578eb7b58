"""What ``nacre convert`` makes of what."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.source import open_source, reopen
from nacre.cli.terminal import CommandError, written_file

if TYPE_CHECKING:
    from nacre import Camera, Cloud, Trajectory
    from nacre.datasets import Sequence
    from nacre.io.point_conversion import Converted

Figures = dict[str, int | list[str]]


class Target(str, Enum):
    """The formats that no ending tells."""

    colmap = "colmap"
    nerfstudio = "nerfstudio"
    tum = "tum"
    kitti = "kitti"
    redwood = "redwood"


@dataclass(frozen=True)
class Job:
    """What is to be converted, and how a recording is to be opened."""

    source: Path
    out: Path
    to: Target | None
    format: str | None
    camera: Camera | Path | None
    depth_scale: float | None

    def recording(
        self,
        path: Path,
        format: str | None = None,
        camera: Camera | None = None,
        depth_scale: float | None = None,
    ) -> Sequence:
        """Open a recording; the command's options go before what is known of it."""
        return open_source(
            path, self.format or format, self.camera or camera, self.depth_scale or depth_scale
        )


def _points(job: Job) -> Figures:
    from nacre.io.point_conversion import convert_points

    return _told(convert_points(job.source, job.out))


def _vertices(job: Job) -> Figures:
    import nacre
    from nacre.io.meshes import read_mesh_arrays
    from nacre.io.point_conversion import write_pieces

    mesh = read_mesh_arrays(job.source)
    cloud = nacre.Cloud(mesh.vertices, mesh.normals, mesh.colors, comments=mesh.comments)
    return _told(write_pieces(job.out, lambda: [cloud]))


def _model(job: Job) -> Figures:
    from nacre.io.point_conversion import convert_points

    return _told(convert_points(written_file(job.source, "model.ply"), job.out))


def _told(done: Converted) -> Figures:
    figures: Figures = {"num_points": done.num_points, "fields": done.fields}
    if done.not_finite_left_out:
        figures["not_finite_left_out"] = done.not_finite_left_out
    if done.not_numbers_left_out:
        figures["not_numbers_left_out"] = done.not_numbers_left_out
    return figures


def _mesh(job: Job) -> Figures:
    import numpy as np

    import nacre
    from nacre.io.meshes import lost_in, read_mesh_arrays

    mesh = read_mesh_arrays(job.source)
    if not len(mesh.triangles) or not np.isfinite(mesh.vertices).all():
        what = "vertices that are not finite" if len(mesh.triangles) else "no triangle"
        raise CommandError(f"{job.source} has {what}")
    nacre.write_mesh(
        job.out,
        mesh.vertices,
        mesh.triangles,
        normals=mesh.normals,
        colors=mesh.colors,
        attributes=mesh.attributes,
        comments=mesh.comments,
    )
    lost = lost_in(job.out, mesh)
    fields = {"normals": mesh.normals, "colors": mesh.colors, **mesh.attributes}
    return {
        "num_vertices": len(mesh.vertices),
        "num_triangles": len(mesh.triangles),
        "fields": [name for name, array in fields.items() if array is not None and name not in lost],
    }


def _trajectory(job: Job) -> Figures:
    import nacre

    return _write_trajectory(job, nacre.read_trajectory(job.source))


def _camera_path(job: Job) -> Figures:
    import nacre

    return _write_trajectory(job, nacre.read_trajectory(written_file(job.source, "trajectory.txt")))


def _truth(job: Job) -> Figures:
    truth = job.recording(job.source).truth
    if truth is None:
        raise CommandError(f"{job.source} has no true poses: nacre reconstruct finds some")
    return _write_trajectory(job, truth)


def _write_trajectory(job: Job, trajectory: Trajectory) -> Figures:
    import nacre

    format: Any = None if job.to is None else job.to.value
    nacre.write_trajectory(job.out, trajectory.timestamps, trajectory.poses, format=format)
    return {"num_poses": len(trajectory)}


def _images_of_run(job: Job) -> Figures:
    import nacre
    from nacre.run_data.saved_run import SavedRun

    sequence, poses = reopen(SavedRun(job.source), job.recording)
    return _write_images(job, sequence, poses, nacre.read_points(written_file(job.source, "model.ply")))


def _images_of_recording(job: Job) -> Figures:
    from nacre._internal.arrays import stacked_poses

    sequence = job.recording(job.source)
    if sequence.truth is None:
        commands = f"nacre reconstruct {job.source} -o RUN, then nacre convert RUN {job.out}"
        raise CommandError(f"{job.source} has no true poses: {commands}")
    poses = stacked_poses(sequence.true_pose(i) for i in range(len(sequence)))
    return _write_images(job, sequence, poses, None)


def _write_images(job: Job, sequence: Sequence, poses: Any, cloud: Cloud | None) -> Figures:
    from nacre.datasets import write_colmap, write_nerfstudio

    if not sequence.has_color:
        raise CommandError(f"{sequence.path} has no colour images, which COLMAP and nerfstudio need")
    write = write_colmap if job.to is Target.colmap else write_nerfstudio
    num_images = write(job.out, sequence, poses, cloud=cloud)
    return {"num_images": num_images, "num_points": 0 if cloud is None else len(cloud)}


CONVERSIONS: dict[tuple[str, str], Callable[[Job], Figures]] = {
    ("points", "points"): _points,
    ("mesh", "points"): _vertices,
    ("mesh", "mesh"): _mesh,
    ("trajectory", "trajectory"): _trajectory,
    ("run", "points"): _model,
    ("run", "trajectory"): _camera_path,
    ("run", "images"): _images_of_run,
    ("recording", "trajectory"): _truth,
    ("recording", "images"): _images_of_recording,
}
