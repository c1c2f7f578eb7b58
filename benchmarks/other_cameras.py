#!/usr/bin/env python
"""
Run simulated cameras of four kinds through scenes and at speeds that no number in nacre was fitted to.

The errors are those of `nacre.simulate_depth`'s sensors, which `sensors.py` compares with real ones; the
scenes are made in `other_scenes.py`. A flat is walked through with the camera in the hand, at so many frames
a second; the camera passes a wall with boxes on it, all of whose faces look one way, in steps of so many
millimetres; cartons in a corner are walked around, in steps of so many degrees; a figure as tall as a
person, and a cow of 0.8 m, turn before the camera, alone; two people stand before a desk for two seconds,
and then walk about, while somebody holds the camera. Things on a table are walked around, and a head, in
steps of so many degrees; a camera before a shelf of books twists by so many degrees a frame; one turns about
itself in a room; somebody walks along a corridor, or over a bare floor, of which nothing should be claimed,
in steps of so many millimetres.
With `--colors` walls and things are printed with a soft pattern, and the camera takes colour images, too.
With `--cameras` four of the scenes are seen by cameras of other sizes and lenses.

    python benchmarks/other_cameras.py
    python benchmarks/other_cameras.py cartons stereo
    python benchmarks/other_cameras.py wall corridor room --colors
    python benchmarks/other_cameras.py --cameras
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import cases
import numpy as np
import numpy.typing as npt
import other_scenes as scenes
from flat import flat_mesh

import nacre

Array = npt.NDArray[Any]

SENSORS = ("structured_light", "time_of_flight", "stereo", "phone_lidar")
# Of each scene: frames a second, or millimetres or degrees from frame to frame, and the number of frames.
SCENES = {
    "flat": ((30, 60), (10, 60), (5, 60), (3, 60)),
    "wall": ((10, 60), (40, 30)),
    "cartons": ((5, 60), (10, 36), (20, 17)),
    "homer": ((7, 52), (15, 24)),
    "spot": ((7, 52),),
    "people": ((30, 108), (10, 36)),
    "table": ((2, 60), (8, 45)),
    "bust": ((4, 90),),
    "shelf": ((1, 60), (3, 60)),
    "room": ((2, 60), (6, 60)),
    "corridor": ((30, 60), (10, 40)),
    "floor": ((5, 40), (15, 40)),
}
# Other sizes and lenses: the kind of sensor, width and height, and the focal length [pixels].
CAMERAS = {
    "160 x 120, 58 degrees": ("time_of_flight", 160, 120, 145),
    "224 x 172, 56 degrees": ("time_of_flight", 224, 172, 210),
    "512 x 512, 91 degrees": ("time_of_flight", 512, 512, 252),
    "424 x 240, 90 degrees": ("stereo", 424, 240, 212),
    "848 x 480, 90 degrees": ("stereo", 848, 480, 425),
    "1280 x 720, 101 degrees": ("stereo", 1280, 720, 530),
    "320 x 240, 59 degrees": ("structured_light", 320, 240, 285),
    "640 x 480, 68 degrees": ("structured_light", 640, 480, 475),
    "640 x 480, 67 degrees": ("phone_lidar", 640, 480, 480),
}
SEEN_BY_THEM = (("flat", 10, 40), ("table", 8, 30), ("cartons", 10, 24), ("shelf", 3, 30))
UNITS = dict.fromkeys(("flat", "people", "corridor"), "frames a second")
UNITS |= dict.fromkeys(("wall", "floor"), "mm")
DISTANCES = {"homer": 2.2, "spot": 1.2, "cartons": 2.0}  # [m]


def colors_of(mesh: nacre.Mesh, camera: nacre.Camera, poses: list[Array]) -> list[Array | None]:
    """Return images of a soft pattern on all surfaces, with the camera's noise and exposure."""
    rng = np.random.default_rng(77)
    waves = rng.normal(size=(30, 3))
    waves *= (rng.uniform(10, 60, 30) / np.linalg.norm(waves, axis=1))[:, None]  # details of 5 to 30 cm
    phases = rng.uniform(0, 2 * math.pi, 30)
    return [
        cases.photograph(mesh, camera, pose, waves, phases, 1 + 0.1 * math.sin(k / 5), rng)
        for k, pose in enumerate(poses)
    ]


def make(
    scene: str,
    sensor: str,
    speed: int,
    count: int,
    colored: bool = False,
    camera: nacre.Camera | None = None,
) -> cases.Case:
    """Return a recording, by a camera of another size where one is given."""
    still: dict[str, tuple[Callable[[], nacre.Mesh], Callable[[], list[Array]]]] = {
        "table": (scenes.table, lambda: scenes.in_hand(speed, count, 0.6, 0.35, [0, -0.05, 0])),
        "bust": (scenes.bust, lambda: scenes.in_hand(speed, count, 0.5, 0.05, [0, 0.05, 0])),
        "shelf": (scenes.shelf, lambda: scenes.twisting(speed, count)),
        "room": (scenes.room, lambda: scenes.turning(speed, count)),
        "corridor": (scenes.corridor, lambda: scenes.along(speed, count)),
        "floor": (scenes.floor, lambda: scenes.over(speed, count)),
    }
    if scene in still:
        mesh_of, poses_of = still[scene]
        meshes, poses = [mesh_of()] * count, poses_of()
    elif scene == "people":
        meshes, poses = scenes.people(speed, count)
    elif scene == "flat":
        meshes, poses = [flat_mesh()] * count, scenes.walk(speed, count)
    elif scene == "wall":
        meshes, poses = [scenes.wall()] * count, scenes.passing(speed, count)
    elif scene == "cartons":
        meshes, poses = (
            [scenes.cartons()] * count,
            scenes.around(speed, count, DISTANCES[scene], -0.2, np.array([0, 0.5, 0])),
        )
    else:
        meshes, poses = (
            [scenes.figure(scene)] * count,
            scenes.around(speed, count, DISTANCES[scene], 0.0, np.zeros(3)),
        )
    camera = camera or cases.SENSORS[sensor]
    kind: Any = sensor
    depths = [
        mesh.simulate_depth(camera, pose, sensor=kind, seed=k, num_threads=1)
        for k, (mesh, pose) in enumerate(zip(meshes, poses, strict=True))
    ]
    colors: list[Array | None] = colors_of(meshes[0], camera, poses) if colored else [None] * count
    return cases.Case(f"{scene} {sensor} {speed}", camera, depths, colors, list(poses))


def run(recording: tuple[str, str, int, int, bool]) -> str:
    """Run a recording, and return its cell: right / claimed / far off of all, and the trajectory's error."""
    return cell(make(*recording))


def run_camera(recording: tuple[str, str, int, int]) -> str:
    """Run a scene before one of CAMERAS, and return its cell."""
    name, scene, speed, count = recording
    sensor, width, height, focal = CAMERAS[name]
    camera = nacre.Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
    return cell(make(scene, sensor, speed, count, camera=camera))


def cell(case: cases.Case) -> str:
    """Return right / claimed / far off of all frames, and the trajectory's error."""
    figures, model = cases.run(case)
    far_off = cases.count_far_off(case, model)
    return f"{figures.right} / {figures.claimed} / {far_off} of {figures.frames}, {figures.ate:.0f} mm"


def print_cameras(processes: int) -> None:
    """Print the table of CAMERAS."""
    titles = [f"{scene}, {speed} {UNITS.get(scene, 'degrees')}" for scene, speed, _ in SEEN_BY_THEM]
    print(f"| kind | size, width of the view | {' | '.join(titles)} |")
    print(f"| --- | --- | {' | '.join('---' for _ in titles)} |")
    with ProcessPoolExecutor(processes) as pool:
        cells = pool.map(run_camera, [(name, *scene) for name in CAMERAS for scene in SEEN_BY_THEM])
        for name, (sensor, *_) in CAMERAS.items():
            print(f"| {sensor} | {name} | {' | '.join(next(cells) for _ in titles)} |", flush=True)


def main() -> None:
    """Run the chosen and sensors that are named, or all, and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *SCENES, *SENSORS], default=[], metavar="NAME")
    parser.add_argument("--colors", action="store_true", help="of chosen that keep still")
    parser.add_argument("--cameras", action="store_true", help="other sizes and lenses, four chosen")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    if arguments.cameras:
        print_cameras(arguments.processes)
        return
    chosen = [name for name in SCENES if name in arguments.names] or list(SCENES)
    sensors = [name for name in SENSORS if name in arguments.names] or list(SENSORS)
    rows = [(scene, *speed) for scene in chosen for speed in SCENES[scene]]
    print(f"| scene | {' | '.join(sensors)} |")
    print(f"| --- | {' | '.join('---' for _ in sensors)} |")
    with ProcessPoolExecutor(arguments.processes) as pool:
        todo = [
            (scene, sensor, speed, count, arguments.colors)
            for scene, speed, count in rows
            for sensor in sensors
        ]
        cells = pool.map(run, todo)
        for scene, speed, _ in rows:
            name = f"{scene}, {speed} {UNITS.get(scene, 'degrees')}"
            print(f"| {name} | {' | '.join(next(cells) for _ in sensors)} |", flush=True)


if __name__ == "__main__":
    main()
