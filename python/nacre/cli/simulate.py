"""``nacre simulate``: a depth recording of a mesh."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose

if TYPE_CHECKING:
    from nacre import Camera, Mesh

_log = logging.getLogger(__name__)

BUILT_IN = "built-in"

# What a depth image of a model may hold [m].
_NEAREST, _FARTHEST = 0.05, 50.0
_MOST_PIXELS = 4096
_SCALES = (50000.0, 10000.0, 5000.0, 1000.0)


def simulate(
    mesh: Annotated[
        str,
        typer.Argument(
            metavar="MESH",
            help='A mesh in metres (PLY, GLB, OBJ, OFF, STL), or the word "built-in".',
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="OUT", help="Folder for the recording.", show_default=False)
    ],
    views: Annotated[int, typer.Option(min=1, help="How many depth images.")] = 12,
    step: Annotated[
        float, typer.Option(min=-720, max=720, help="Turn of the camera from view to view (degrees).")
    ] = 30.0,
    noise: Annotated[
        str,
        typer.Option(
            metavar="METRES|kinect|stereo|tof", help="Standard deviation of the depth noise (metres)."
        ),
    ] = "0",
    sensor: Annotated[
        str,
        typer.Option(
            metavar="stereo|structured_light|time_of_flight|phone_lidar",
            help="A kind of depth camera, with its errors.",
            show_default=False,
        ),
    ] = "none",
    orthographic: Annotated[
        bool, typer.Option("--orthographic", help="Parallel rays instead of a pinhole camera.")
    ] = False,
    width: Annotated[
        int | None, typer.Option(min=1, help="Of the image (pixels).", show_default="640")
    ] = None,
    height: Annotated[
        int | None, typer.Option(min=1, help="Of the image (pixels).", show_default="480")
    ] = None,
    pixel_size: Annotated[
        float | None, typer.Option(help="Of an orthographic camera (metres).", show_default="fits the mesh")
    ] = None,
    fx: Annotated[
        float | None, typer.Option(help="Focal length (pixels).", show_default="0.82 width")
    ] = None,
    fy: Annotated[float | None, typer.Option(help="Focal length (pixels).", show_default="fx")] = None,
    cx: Annotated[float | None, typer.Option(help="Principal point (pixels).", show_default="middle")] = None,
    cy: Annotated[float | None, typer.Option(help="Principal point (pixels).", show_default="middle")] = None,
    distance: Annotated[
        float | None,
        typer.Option(help="From the camera to the mesh's centre (metres).", show_default="fits the mesh"),
    ] = None,
    elevation: Annotated[float, typer.Option(help="Of the camera above the centre (degrees).")] = 0.0,
    edge_mixing: Annotated[
        bool, typer.Option("--edge-mixing", help="Mix depths at edges, as real sensors do.")
    ] = False,
    quantization: Annotated[
        float, typer.Option(min=0, help="Round depth to multiples of this (metres).")
    ] = 0.0,
    dropout: Annotated[
        float, typer.Option(min=0, max=1, help="Part of the pixels without measurement.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is random.")] = 0,
    scale: Annotated[
        float, typer.Option(help="Metres per unit of the mesh file: 0.001 for millimetres.")
    ] = 1.0,
    depth_scale: Annotated[
        float | None,
        typer.Option(help="Stored depth units per metre.", show_default="the finest that fits 16 bits"),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Make a depth recording of a mesh, with a camera that circles around it.

    OUT gets camera.json, depth/ (16-bit PNG) and groundtruth.txt, the camera's poses in the mesh's frame.
    """
    terminal = Terminal(json, quiet, verbose)
    import nacre
    from nacre.io.json_files import to_json
    from nacre.io.writable_folder import writable_folder
    from nacre.reconstruction.description import describe_camera

    surface = _mesh(mesh, scale)
    camera = _camera(surface, orthographic, width, height, pixel_size, fx, fy, cx, cy)
    amount, kind = _noise(noise), _sensor(sensor, orthographic, edge_mixing)
    poses = nacre.turntable_poses(
        surface,
        views,
        math.radians(step),
        camera=camera,
        distance=distance,
        elevation=math.radians(elevation),
    )
    farthest = _check_size(surface, poses[0], mesh)
    reach = math.inf
    if depth_scale is None:
        depth_scale = next((s for s in _SCALES if 1.1 * farthest * s <= 65534), _SCALES[-1])
        reach = 65534 / depth_scale  # errors far beyond the mesh: cameras have a longest distance, too
    writable_folder(out)
    terminal.say(f"{mesh}: {surface!r}\n{views} views every {step:g} degrees, {describe_camera(camera)}")
    empty = []
    with terminal.progress("views", views) as advance:

        def images() -> Any:
            for i, pose in enumerate(poses):
                image = surface.simulate_depth(
                    camera,
                    pose,
                    sensor=kind,
                    noise=amount,
                    edge_mixing=float(edge_mixing),
                    quantization=quantization,
                    dropout=dropout,
                    seed=seed + i,
                )
                image[image > reach] = math.nan
                if not (image > 0).any():
                    empty.append(i)
                yield image
                advance("")

        count = nacre.write_recording(out, camera, images(), depth_scale=depth_scale, poses=poses)
    if len(empty) == count:
        raise CommandError("no view shows anything of the mesh; see --distance and the camera's options")
    terminal.say(f"wrote {count} views to {out}, {depth_scale:g} units per metre")
    terminal.say(f"next: nacre reconstruct {out} -o {out}-model")
    if json:
        print(
            to_json(
                {
                    "out": out,
                    "views": count,
                    "depth_scale": depth_scale,
                    "camera": repr(camera),
                    "empty": empty,
                }
            )
        )


def _mesh(name: str, scale: float) -> Mesh:
    import nacre

    if not (math.isfinite(scale) and scale > 0):
        raise CommandError(f"--scale must be a positive number, got {scale}", 2)
    surface = nacre.built_in_object() if name == BUILT_IN else nacre.read_mesh(name)
    return surface if scale == 1 else nacre.Mesh(scale * surface.vertices, surface.triangles)


def _noise(text: str) -> Any:
    if text in ("kinect", "stereo", "tof"):
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise CommandError(
            f"--noise must be a length in metres or one of kinect, stereo, tof, got {text!r}", 2
        )
    return value


def _sensor(name: str, orthographic: bool, edge_mixing: bool) -> Any:
    from typing import get_args

    from nacre.mesh import SensorName

    kinds = get_args(SensorName)
    if name not in kinds:
        raise CommandError(f"--sensor must be one of {', '.join(kinds)}, got {name!r}", 2)
    if name != "none" and orthographic:
        raise CommandError("--sensor is for a pinhole camera; leave out --orthographic", 2)
    if name != "none" and edge_mixing:
        raise CommandError("--sensor mixes edges by itself; leave out --edge-mixing", 2)
    return name


def _camera(
    surface: Mesh,
    orthographic: bool,
    width: int | None,
    height: int | None,
    pixel_size: float | None,
    fx: float | None,
    fy: float | None,
    cx: float | None,
    cy: float | None,
) -> Camera:
    import nacre

    intrinsics = {"--fx": fx, "--fy": fy, "--cx": cx, "--cy": cy}
    if orthographic:
        given = [name for name, value in intrinsics.items() if value is not None]
        if given:
            raise CommandError(f"{given[0]} is for a pinhole camera; leave out --orthographic", 2)
        fitting = nacre.default_camera(surface)
        size = pixel_size if pixel_size is not None else fitting.pixel_size
        if not (math.isfinite(size) and size > 0):
            raise CommandError(f"--pixel-size must be a positive length in metres, got {size}", 2)
        pixels = math.ceil(fitting.width * fitting.pixel_size / size)
        if pixels > _MOST_PIXELS and not (width and height):
            raise CommandError(
                f"the mesh is {fitting.width * fitting.pixel_size:.4g} m across, "
                f"{pixels} pixels of {1000 * size:g} mm; give --scale (metres per unit "
                "of the file), a larger --pixel-size, or --width and --height",
                2,
            )
        return nacre.Camera.orthographic(width=width or pixels, height=height or pixels, pixel_size=size)
    if pixel_size is not None:
        raise CommandError("--pixel-size is for an orthographic camera; add --orthographic", 2)
    width, height = width or 640, height or 480
    focal = fx if fx is not None else 525 * width / 640
    return nacre.Camera(
        width=width,
        height=height,
        fx=focal,
        fy=fy if fy is not None else focal,
        cx=cx if cx is not None else (width - 1) / 2,
        cy=cy if cy is not None else (height - 1) / 2,
    )


def _check_size(surface: Mesh, pose: Any, name: str) -> float:
    """Return the farthest depth that views may have, or say that the unit is not metres."""
    import numpy as np

    lower, upper = surface.bounds
    diagonal = float(np.linalg.norm(upper - lower))
    distance = float(np.linalg.norm(pose[:3, 3] - 0.5 * (lower + upper)))
    if not _NEAREST <= distance <= _FARTHEST:
        sides = " x ".join(f"{side:.4g}" for side in upper - lower)
        guess = "0.001" if distance > _FARTHEST else "1000"
        raise CommandError(
            f"{name} is {sides} m large and {distance:.4g} m from the camera, where depth cameras see from "
            f"{_NEAREST:g} to {_FARTHEST:g} m; is its unit another one? "
            f"Give --scale (metres per unit, such as {guess}) or --distance",
            2,
        )
    if ((pose[:3, 3] > lower) & (pose[:3, 3] < upper)).all():
        _log.warning("the camera stands inside the box around %s; see --distance and --scale", name)
    return distance + 0.5 * diagonal
