"""The rows of the table."""

from __future__ import annotations

import json
from pathlib import Path

from track import experiments, shapes
from track.peers import ANY_CAMERA, NEAR, PINHOLE
from track.recordings import KINECT, ORTHOGRAPHIC, Make, found, plain, simulated, without_frames
from track.rows import Goal, Places, Row

DOG_CAMERA = json.dumps(
    {
        "model": "pinhole", "width": 640, "height": 480, "fx": 616.87, "fy": 617.06,
        "cx": 319.57, "cy": 233.06, "depth_scale": 1000,
    }
)  # fmt: skip


def bunny(places: Places) -> Path:
    """Return the bunny's mesh."""
    return places.bunny


def mesh(name: str) -> Make:
    """Return what finds another mesh."""
    return found(f"meshes/{name}")


def at_most(**limits: float) -> tuple[Goal, ...]:
    """Return bounds from above, on absolute values."""
    return tuple(Goal(name, limit, absolute=True) for name, limit in limits.items())


def at_least(**limits: float) -> tuple[Goal, ...]:
    """Return bounds from below."""
    return tuple(Goal(name, limit, at_least=True) for name, limit in limits.items())


def turntable(
    name: str,
    title: str,
    views: int,
    step: int,
    goals: tuple[Goal, ...],
    *,
    surface: Make = bunny,
    scale: float = 1.0,
    sensor: tuple[str, ...] = (*ORTHOGRAPHIC, "--noise", "0.0005"),
    peers: tuple[str, ...] = (),
) -> Row:
    """Return an object on a turntable, with mixed pixels at the edges."""
    options: tuple[str | float, ...] = (*sensor, "--views", views, "--step", step, "--scale", scale)
    return Row(
        name,
        title,
        recording=simulated(name, surface, *options),
        mesh=surface,
        scale=scale,
        peers=peers,
        goals=(*at_least(tracked=views), *goals),
    )


SHAPE = at_most(rms=0.12, bias=0.02, cov=0.15) + at_least(complete=99.0)
KINECT_GOALS = at_most(final_rotation=0.3, final_translation=1.0, rms=0.4)
NOISY = (*ORTHOGRAPHIC, "--noise", "0.001")
OTHERS = {
    "homer": ("homer.obj", 0.2, "Homer, 0.17 m high"),
    "spot": ("spot.obj", 0.1, "Spot, 0.17 m high"),
    "fandisk": ("libigl_fandisk.off", 0.03, "Fandisk, 0.16 m high"),
}

ROWS = [
    turntable(
        "bunny12",
        "Bunny, 12 views every 30 degrees, sigma 0.5 mm",
        12,
        30,
        at_most(rotation=0.1, translation=0.2) + SHAPE,
        peers=ANY_CAMERA,
    ),
    turntable(
        "bunny12-1mm",
        "Bunny, 12 views every 30 degrees, sigma 1 mm",
        12,
        30,
        at_most(rotation=0.15, translation=0.4, rms=0.3),
        sensor=NOISY,
        peers=("open3d_icp_eroded",),
    ),
    turntable(
        "bunny8", "Bunny, 8 views every 45 degrees, sigma 0.5 mm", 8, 45, (), peers=("open3d_icp_eroded",)
    ),
    turntable(
        "bunny6", "Bunny, 6 views every 60 degrees, sigma 0.5 mm", 6, 60, (), peers=("open3d_icp_eroded",)
    ),
    *(
        turntable(
            f"{name}12",
            f"{title}, 12 views every 30 degrees, sigma 0.5 mm",
            12,
            30,
            at_most(final_rotation=0.3, final_translation=1.0, rms=0.167),
            surface=mesh(file),
            scale=scale,
            peers=("open3d_icp_eroded",),
        )
        for name, (file, scale, title) in OTHERS.items()
    ),
    *(
        turntable(
            f"{name}-kinect{views}",
            f"{title}, pinhole camera at 0.5 m with Kinect noise, {views} views every {step} degrees",
            views,
            step,
            KINECT_GOALS,
            surface=surface,
            scale=scale,
            sensor=KINECT,
            peers=peers,
        )
        for name, title, surface, scale, views, step, peers in [
            ("bunny", "Bunny", bunny, 1.0, 120, 3, ("open3d_icp_eroded", "open3d_slam", "opencv_tsdf")),
            ("bunny", "Bunny", bunny, 1.0, 36, 10, ("open3d_icp_eroded", "open3d_slam", "opencv_tsdf")),
            *(
                (name, title, mesh(file), scale, views, step, ("open3d_icp_eroded",))
                for name, (file, scale, title) in OTHERS.items()
                for views, step in ((120, 3), (36, 10))
            ),
        ]
    ),
    Row(
        "bunny-scans",
        "The bunny's ten real range scans, in several orders",
        measure=experiments.range_scans,
        goals=at_most(lost=0, weak=0, rotation=1.0, translation=1.0),
        note="Rotations and shifts are the greatest of the turntable's six scans against bun.conf.",
    ),
    Row(
        "teddy",
        "tum-fr3-teddy, whole view, 200 frames",
        recording=found("tum-fr3-teddy"),
        voxel=0.01,
        peers=(*ANY_CAMERA, *PINHOLE, *NEAR),
        goals=at_most(ate=12, lost=0),
    ),
    Row(
        "rpy",
        "tum-fr1-rpy, 100 frames of fast rotation",
        recording=found("tum-fr1-rpy"),
        voxel=0.01,
        peers=(*ANY_CAMERA, *PINHOLE, *NEAR),
        goals=at_most(ate=25, lost=0),
    ),
    Row(
        "teddy-cut",
        "tum-fr3-teddy without its frames 85 to 114",
        recording=without_frames("teddy-cut", found("tum-fr3-teddy"), 85, 114),
        voxel=0.01,
        peers=("open3d_icp_eroded", "open3d_slam"),
        goals=at_most(ate=15, lost=0),
        note="The camera is somewhere else when it comes back: what follows is to be recovered.",
    ),
    Row(
        "dog",
        "realsense-turntable-dog, 6 views joined",
        recording=plain("dog", found("realsense-turntable-dog/data1"), "depth_*.png", DOG_CAMERA),
        settings={"nacre": ["--object"]},
        goals=at_most(lost=0, weak=0),
        note="A toy on a sheet of paper, turned by 28 to 92 degrees between views; nacre with `--object`. "
        "There are no true poses; see the picture.",
    ),
    *(
        Row(
            f"weak-{name}",
            f"{title}: must be called weak",
            recording=simulated(f"weak-{name}", surface, *sensor, "--views", 6, "--step", step),
            goals=at_least(weak=5),
        )
        for name, title, surface, sensor, step in [
            ("wall", "A wall", shapes.wall, ("--noise", "0.001", "--distance", "0.6"), 1),
            ("cylinder", "A pipe", shapes.cylinder, ("--noise", "0.001", "--distance", "0.5"), 5),
            ("sphere", "A ball", shapes.sphere, ("--noise", "0.001", "--distance", "0.5"), 5),
        ]
    ),
    Row(
        "unrelated",
        "1000 pairs of images of different scenes",
        measure=experiments.unrelated_pairs,
        goals=at_most(tracked=1),
        note="Each second image is registered to a model of the first; what is tracked is a false accept.",
    ),
    Row(
        "long",
        "Bunny, 2000 frames of Kinect noise, 16 turns",
        measure=experiments.long_recording,
        goals=(
            *at_least(tracked=2000),
            *(Goal(name, 10) for name in ("more_points", "more_time")),
            Goal("more_memory", 16),
        ),
        note="Once the surface is covered, size stays; so does time, but for the machine's scatter. "
        "A frame takes 260 bytes.",
    ),
    Row(
        "fusion-methods",
        "Bunny, 12 views every 30 degrees: how frames are fused",
        recording=simulated(
            "bunny12", bunny, *ORTHOGRAPHIC, "--noise", "0.0005", "--views", 12, "--step", 30, "--scale", 1.0
        ),
        mesh=bunny,
        measure=experiments.fusion_methods,
    ),
]
UNTUNED = ("open3d_icp", "open3d_slam", "opencv_tsdf", "small_gicp_vgicp_eroded")
ROWS += [
    Row(f"real-{name}", f"{name}: {camera}", recording=found(name), peers=UNTUNED, real=True)
    for name, camera in {
        "truedepth-boxcan": "iPhone TrueDepth, once round a carton",
        "sr300-shelf": "RealSense SR300 round a box",
        "apc-shelf-f200": "RealSense F200 on a robot",
        "tum-fr3-cabinet-kf": "Xtion, a cabinet from all sides",
        "realsense-robot-objects": "RealSense D435 on a robot, out of order",
        "tum-fr1-rpy": "Kinect, fast rotation",
        "tum-fr3-teddy": "Xtion round a toy",
        "icl-livingroom-loop-fast": "rendered, a room",
        "d435-t265-shelf": "RealSense D435 in the hand",
        "record3d-door": "iPhone LiDAR, a flat door",
        "iphone-lidar-office-a": "iPhone LiDAR, an office",
    }.items()
]
BY_NAME = {row.name: row for row in ROWS}
