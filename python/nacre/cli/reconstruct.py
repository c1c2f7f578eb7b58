"""``nacre reconstruct``: a recording becomes a model."""

from __future__ import annotations

import dataclasses
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.calibrating import run_calibrated
from nacre.cli.config import ConfigOption, PresetOption, SetOption, model_parameters
from nacre.cli.feed import LiveFeed, camera_feed, is_camera, real_time_feed
from nacre.cli.results import file_rows, trajectory_rows, write_results
from nacre.cli.running import retry_lost, run_frames
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption, describe_camera, open_source
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, table, to_json, writable_folder
from nacre.cli.view import PortOption

if TYPE_CHECKING:
    from nacre.datasets import Sequence


def reconstruct(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="The recording: a folder or a file; or a camera: realsense, realsense:SERIAL.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="OUT", help="Folder for the results.", show_default=False)
    ],
    format: FormatOption = None,
    camera: CameraOption = None,
    depth_scale: DepthScaleOption = None,
    min_depth: Annotated[
        float | None, typer.Option(help="Nearer measurements are not used (metres).", show_default=False)
    ] = None,
    max_depth: Annotated[
        float | None, typer.Option(help="Farther measurements are not used (metres).", show_default=False)
    ] = None,
    box: Annotated[
        tuple[float, float, float, float, float, float] | None,
        typer.Option(
            metavar="X0 X1 Y0 Y1 Z0 Z1",
            help="Model only what is in this box of the camera's frame (metres; x right, y down, z forward).",
            show_default=False,
        ),
    ] = None,
    object: Annotated[
        bool,
        typer.Option(
            "--object", help="Model only the largest thing that stands on a plane, e.g. a turntable."
        ),
    ] = False,
    masks: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Images named as the depth images; black pixels are not used.",
            show_default="the recording's",
        ),
    ] = None,
    every: Annotated[int, typer.Option(min=1, metavar="N", help="Use every N-th frame.")] = 1,
    first: Annotated[int, typer.Option(min=0, metavar="INDEX", help="The first frame, from 0.")] = 0,
    last: Annotated[
        int | None, typer.Option(min=0, metavar="INDEX", help="The last frame.", show_default="all")
    ] = None,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime", help="Play the recording as a camera would; frames that come too fast are dropped."
        ),
    ] = False,
    color: Annotated[bool, typer.Option("--color/--no-color", help="Give the model colours.")] = True,
    retry: Annotated[
        bool,
        typer.Option("--retry/--no-retry", help="At the end, try lost frames again while any is found."),
    ] = True,
    loop_closure: Annotated[
        bool | None,
        typer.Option(
            "--loop-closure/--no-loop-closure",
            help="Correct model and poses where the camera comes back to what it saw before.",
            show_default="on",
        ),
    ] = None,
    calibrate: Annotated[
        bool,
        typer.Option(
            "--calibrate/--no-calibrate",
            help="Where views in several directions show that depth is systematically wrong, correct it.",
        ),
    ] = True,
    attribute: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FOLDER",
            help="Images of anything else, named as the depth images; fused along. May be repeated.",
        ),
    ] = None,
    view: Annotated[
        bool, typer.Option("--view", help="Show the model in the browser while it grows.")
    ] = False,
    port: PortOption = 8080,
    preset: PresetOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Make a model from a recording of a depth camera.

    The recording may be TUM RGB-D, Redwood/Open3D, 7-Scenes, ICL-NUIM, ROS 1 or 2 (MCAP and RealSense too),
    Record3D, Stray Scanner, images of an Azure Kinect, Stanford range scans, a plain recording (camera.json
    and depth/), or a folder of depth images with --camera and --depth-scale; its format is recognised.

    SOURCE realsense is a camera: it runs until Ctrl-C or --last, and OUT/recording keeps what was used.
    Where frames come faster than they can be registered, the oldest are dropped and counted.

    OUT gets model.ply (points with normals, in the first camera's frame), trajectory.txt, report.json and
    report.html. A frame that cannot be read or registered is LOST and changes nothing.
    The frames may be far apart and in any order: a lost camera is searched for everywhere.
    """
    terminal = Terminal(json, quiet, verbose)
    more: dict[str, Any] = {
        "depth.min_depth": min_depth,
        "depth.max_depth": max_depth,
        "loop_closure": loop_closure,
    }
    sides = ("min_x", "max_x", "min_y", "max_y", "min_z", "max_z")
    more |= {f"region.{side}": value for side, value in zip(sides, box or (), strict=box is not None)}
    more["region.object"] = object or None
    parameters, preset_name = model_parameters(preset, config, settings, **more)
    feed: LiveFeed | None = None
    pick = (first, None if last is None else last + 1, every)
    if is_camera(source):
        given = {"--format": format, "--camera": camera, "--depth-scale": depth_scale, "--masks": masks}
        for option, value in (given | {"--attribute": attribute, "--realtime": realtime or None}).items():
            if value is not None:
                raise CommandError(f"{option} is for recordings, and {source} is a camera", 2)
        feed = camera_feed(source, writable_folder(out), color, pick)
        sequence, words = feed.sequence, f"live, {describe_camera(feed.sequence.camera)}"
    else:
        sequence = open_source(source, format, camera, depth_scale)
        if masks is not None:
            sequence = sequence.with_masks(masks)
        for text in attribute or ():
            name, equals, folder = text.partition("=")
            if not (name and equals and folder):
                raise CommandError(f"--attribute needs NAME=FOLDER, got {text!r}", 2)
            sequence = sequence.with_attribute(name, folder)
        if not color:
            sequence = sequence.without_color()
        indices = range(len(sequence))[slice(*pick)]
        if not indices:
            raise CommandError(f"no frames are left of {len(sequence)} (0 to {len(sequence) - 1})", 2)
        words = describe(sequence, indices)
        if realtime:
            feed = real_time_feed(sequence, indices)
    import nacre
    from nacre.depth_calibration import can_calibrate
    from nacre.reconstruction import Reconstruction

    done = Reconstruction(sequence, nacre.Model(sequence.camera, parameters=parameters))
    writable_folder(out)
    terminal.say(f"{sequence.name}: {words}")
    live = None
    if view:
        from nacre.viewer import LiveView

        live = LiveView(done, sequence.name, port=port)
        terminal.say(f"the model is at {live.viewer.url}")
    # What turns before a camera that stands still is not one scene with what is around it.
    whole = masks is None and parameters.region == nacre.RegionParameters()
    calibration = None
    if feed is not None:
        with closing(feed):
            interrupted = run_frames(terminal, done, feed, watch=live.add if live else None)
        # Who stops a camera is content with what it saw.
        interrupted = interrupted and not feed.is_camera
    elif calibrate and whole and preset_name != "paper" and can_calibrate(sequence.camera):
        done, calibration, interrupted = run_calibrated(terminal, done, sequence, indices, live)
    else:
        interrupted = run_frames(terminal, done, indices, watch=live.add if live else None)
    if retry and not interrupted:
        interrupted = retry_lost(terminal, done)
    done.evaluate_trajectory()
    report = write_results(
        out,
        done,
        title=sequence.name,
        source=words if feed is None else f"{words}; {feed.summary}",
        document={
            "recording": recording(sequence),
            "preset": preset_name,
            "interrupted": interrupted,
            "depth_calibration": calibration
            and dataclasses.asdict(calibration) | {"used": calibration.is_significant},
            "live": None if feed is None else feed.figures,
        },
        figures=None if feed is None else dict(feed.rows),
    )
    if json:
        print(to_json(report))
    rows = [] if feed is None else feed.rows
    terminal.say(table([*trajectory_rows(done), *rows, *file_rows(out)]))
    if live is not None:
        live.finish()
        if not interrupted:
            terminal.say(f"the model stays at {live.viewer.url}; Ctrl-C ends it")
            live.viewer.wait()
        live.viewer.close()
    if interrupted:
        terminal.say(
            f"interrupted after {len(done.frames)} of {len(indices)} frames; what there is was written"
        )
        raise typer.Exit(130)
    if feed is not None and feed.error is not None:
        raise CommandError(f"{feed.error}; what there is was written")
    if done.num_tracked == 0:
        reasons = list(dict.fromkeys(frame.reason for frame in done.frames))
        others = " (and other reasons)" * (len(reasons) > 1)
        raise CommandError(
            f"every frame was lost: {reasons[0]}{others}; nacre info {source} looks at its depth"
        )


def describe(sequence: Sequence, indices: range) -> str:
    """Return in words where the frames come from."""
    step = f", every {indices.step} frames" if indices.step > 1 else ""
    part = "" if len(indices) == len(sequence) else f" (frames {indices[0]} to {indices[-1]}{step})"
    truth = ", with true poses" if sequence.truth is not None else ""
    return (
        f"{len(indices)} of {len(sequence)} frames{part}, {sequence.format} format, "
        f"{describe_camera(sequence.camera)}{truth}"
    )


def recording(sequence: Sequence) -> dict[str, Any]:
    """Return what report.json says about the recording."""
    camera = sequence.camera
    names: tuple[str, ...] = ("model", "width", "height", "pixel_size")
    if camera.model != "orthographic":
        names = ("model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth")
    return {
        "path": str(sequence.path),
        "name": sequence.name,
        "format": sequence.format,
        "num_frames": len(sequence),
        "camera": {name: getattr(camera, name) for name in names},
        "depth_scale": sequence.depth_scale,
        "color": sequence.has_color,
        "truth": sequence.truth is not None,
    }
