"""``nacre reconstruct``: a recording becomes a model."""

from __future__ import annotations

from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated, Any

import typer

from nacre.cli.cameras import CAMERAS, is_camera
from nacre.cli.config import ConfigOption, PresetOption, SetOption, model_parameters
from nacre.cli.job import begun, resumed
from nacre.cli.run import carry_out
from nacre.cli.run_options import RunOptions
from nacre.cli.signals import interruptible
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose
from nacre.cli.view import PortOption
from nacre.cli.window import Window


def reconstruct(
    context: typer.Context,
    source: Annotated[
        Path | None,
        typer.Argument(
            metavar="SOURCE",
            help=f"The recording: a folder or a file; or a camera: {CAMERAS}.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="OUT", help="Folder for the results.", show_default=False),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT",
            help="Go on with the run that was stopped or killed while it wrote to this folder; source and "
            "options are those that it had.",
            show_default=False,
        ),
    ] = None,
    checkpoint_every: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="N",
            help="Save the run in OUT/unfinished after every N frames; 0: only where it is stopped.",
            show_default="about 2 % of the time",
        ),
    ] = None,
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
        bool | None,
        typer.Option(
            "--calibrate/--no-calibrate",
            help="Where views in several directions show that depth is systematically wrong, correct it.",
            show_default="on",
        ),
    ] = None,
    attribute: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FOLDER",
            help="Images of anything else, named as the depth images; fused along. May be repeated.",
        ),
    ] = None,
    all_points: Annotated[
        bool,
        typer.Option(
            "--all-points",
            help="Write the points, too, that are no surface: litter, and layers that surer ones cover.",
        ),
    ] = False,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write report.html.")] = True,
    min_tracked: Annotated[
        float,
        typer.Option(
            min=0, max=1, metavar="PART", help="Exit with 3 where a smaller part of the frames is tracked."
        ),
    ] = 0.5,
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

    A camera runs until Ctrl-C or --last, and OUT/recording keeps what was used; nacre record has a window.
    Where frames come faster than they can be registered, the oldest are dropped and counted.

    OUT gets model.ply (points with normals, in the first camera's frame), trajectory.txt, report.json and
    report.html. A frame that cannot be read or registered is LOST and changes nothing. Where fewer than
    --min-tracked of the frames are tracked, all is written, and the exit code is 3.
    The frames may be far apart and in any order: a lost camera is searched for everywhere.

    Ctrl-C (and SIGTERM) saves the run and writes what there is; --resume OUT goes on with it, and with one
    that was killed, to the same model. OUT/unfinished is there as long as a run is not finished.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre.reconstruction.resume import UnfinishedRun

    window = _window(port) if view else None
    with interruptible() as stop, ExitStack() as ends:
        if resume is not None:
            _refuse_more_options(context, resume)
            unfinished = ends.enter_context(closing(UnfinishedRun(resume, checkpoint_every)))
            job = resumed(unfinished)
        else:
            if source is None or out is None:
                missing = "argument 'SOURCE'" if source is None else "option '--out' / '-o'"
                raise CommandError(f"missing {missing} (see nacre reconstruct --help)", 2)
            unfinished = ends.enter_context(closing(UnfinishedRun(out, checkpoint_every)))
            more: dict[str, Any] = {
                "depth.min_depth": min_depth,
                "depth.max_depth": max_depth,
                "loop_closure": loop_closure,
                "calibrate_depth": calibrate,
            }
            sides = ("min_x", "max_x", "min_y", "max_y", "min_z", "max_z")
            more |= {f"region.{side}": value for side, value in zip(sides, box or (), strict=box is not None)}
            more["region.object"] = object or None
            parameters, preset_name = model_parameters(preset, config, settings, **more)
            options = RunOptions(
                str(source),
                format=format,
                camera=_text(camera),
                depth_scale=depth_scale,
                masks=_text(masks),
                attribute=attribute or [],
                color=color,
                first=first,
                last=last,
                every=every,
                realtime=realtime,
                retry=retry,
                preset=preset_name,
                is_camera=is_camera(source),
                all_points=all_points,
                report=report,
                min_tracked=_part("--min-tracked", min_tracked),
            )
            job = begun(terminal, options, unfinished, parameters, stop, window.controls if window else None)
        carry_out(terminal, job, stop, window)


def _window(port: int) -> Window:
    from nacre.viewer import Controls

    return Window(port, Controls("recording"))


def _part(option: str, value: float) -> float:
    if not 0 <= value <= 1:  # NaN, which the parser lets through
        raise CommandError(f"{option} must be 0 to 1, got {value}", 2)
    return value


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


def _refuse_more_options(context: typer.Context, out: Path) -> None:
    allowed = ("resume", "checkpoint_every", "view", "port", "json", "quiet", "verbose")
    for name in context.params:
        if name not in allowed and str(context.get_parameter_source(name)).endswith("COMMANDLINE"):
            option = "SOURCE" if name == "source" else "--" + name.replace("_", "-")
            raise CommandError(f"--resume takes everything from {out / 'unfinished'}: leave out {option}", 2)
