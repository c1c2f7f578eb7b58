"""``nacre reconstruct``: a recording becomes a model."""

from __future__ import annotations

from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.config import ConfigOption, PresetOption, SetOption, model_parameters
from nacre.cli.live_feed import LiveFeed, camera_feed, is_camera, real_time_feed
from nacre.cli.run import Run, carry_out
from nacre.cli.run_options import RunOptions, asked_before, check_recording, describe
from nacre.cli.signals import interruptible
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption, describe_camera, open_source
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_folder
from nacre.cli.unfinished import Unfinished, read_asked
from nacre.cli.view import PortOption
from nacre.errors import FileFormatError

if TYPE_CHECKING:
    from nacre import ModelParameters


def reconstruct(
    context: typer.Context,
    source: Annotated[
        Path | None,
        typer.Argument(
            metavar="SOURCE",
            help="The recording: a folder or a file; or a camera: realsense, realsense:SERIAL.",
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

    Ctrl-C (and SIGTERM) saves the run and writes what there is; --resume OUT goes on with it, and with one
    that was killed, to the same model. OUT/unfinished is there as long as a run is not finished.
    """
    terminal = Terminal(json, quiet, verbose)
    with interruptible() as stop, ExitStack() as ends:
        if resume is not None:
            unfinished = ends.enter_context(closing(Unfinished(resume, checkpoint_every)))
            run = _resumed(context, unfinished)
        else:
            if source is None or out is None:
                missing = "argument 'SOURCE'" if source is None else "option '--out' / '-o'"
                raise CommandError(f"missing {missing} (see nacre reconstruct --help)", 2)
            unfinished = ends.enter_context(closing(Unfinished(out, checkpoint_every)))
            more: dict[str, Any] = {
                "depth.min_depth": min_depth,
                "depth.max_depth": max_depth,
                "loop_closure": loop_closure,
            }
            sides = ("min_x", "max_x", "min_y", "max_y", "min_z", "max_z")
            more |= {f"region.{side}": value for side, value in zip(sides, box or (), strict=box is not None)}
            more["region.object"] = object or None
            parameters, preset_name = model_parameters(preset, config, settings, **more)
            asked = RunOptions(
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
                calibrate=calibrate,
                preset=preset_name,
                is_camera=is_camera(source),
            )
            run = _begun(terminal, asked, unfinished, parameters)
        carry_out(terminal, run, stop, port if view else None)


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


def _begun(terminal: Terminal, asked: RunOptions, unfinished: Unfinished, parameters: ModelParameters) -> Run:
    """Open what was asked for, and note it in ``OUT/unfinished``."""
    out = unfinished.out
    feed: LiveFeed | None = None
    indices: range | None = None
    if asked.is_camera:
        given: dict[str, Any] = {
            "--format": asked.format,
            "--camera": asked.camera,
            "--depth-scale": asked.depth_scale,
        }
        given |= {"--masks": asked.masks, "--attribute": asked.attribute or None}
        for option, value in (given | {"--realtime": asked.realtime or None}).items():
            if value is not None:
                raise CommandError(f"{option} is for recordings, and {asked.source} is a camera", 2)
        feed = camera_feed(Path(asked.source), writable_folder(out), asked.color, asked.pick)
        sequence, words = feed.sequence, f"live, {describe_camera(feed.sequence.camera)}"
    else:
        sequence = asked.open()
        indices = asked.indices(sequence)
        words = describe(sequence, indices)
        if asked.realtime:
            feed = real_time_feed(sequence, indices)
    import nacre
    from nacre.io.atomic import remove_leftovers
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.calibration import shows_one_scene

    done = Reconstruction(sequence, nacre.Model(sequence.camera, parameters=parameters))
    writable_folder(out)
    unfinished.hold()
    remove_leftovers(out)
    whole = feed is None and shows_one_scene(sequence.camera, parameters)
    calibrates = asked.calibrate and whole and asked.preset != "paper"
    if unfinished.checkpoint.exists():
        terminal.say(
            f"{out} held an unfinished run, which --resume would have gone on with: it is begun again"
        )
    unfinished.stage.name = "views" if calibrates else "frames"
    unfinished.stage.live = None if feed is None else feed.figures
    unfinished.begin(done, asked.document(sequence))
    return Run(asked, out, done, sequence, unfinished, words, indices, feed)


def _resumed(context: typer.Context, unfinished: Unfinished) -> Run:
    """Open what a run was asked for that was stopped or killed, and load what it had."""
    out = unfinished.out
    allowed = ("resume", "checkpoint_every", "view", "port", "json", "quiet", "verbose")
    for name in context.params:
        if name not in allowed and str(context.get_parameter_source(name)).endswith("COMMANDLINE"):
            option = "SOURCE" if name == "source" else "--" + name.replace("_", "-")
            raise CommandError(f"--resume takes everything from {out / 'unfinished'}: leave out {option}", 2)
    if out.is_dir():
        unfinished.hold()
    document = read_asked(out)
    asked, folder = asked_before(document, out / "unfinished" / "run.json")
    if asked.is_camera:
        from nacre.datasets.recorder import mend

        mend(out / "recording")
        sequence = open_source(out / "recording")
        words = f"live, {describe_camera(sequence.camera)}"
        indices: Any = range(len(sequence))
    else:
        sequence = asked.open(folder)
        check_recording(document, sequence)
        indices = asked.indices(sequence)
        words = describe(sequence, indices)
        if asked.realtime:  # what it had seen; which frames come, is the clock's doing
            indices = unfinished.journaled_indices()
            if max(indices, default=0) >= len(sequence):
                reason = f"frame {max(indices)} is none of the recording's {len(sequence)}"
                raise FileFormatError(unfinished.folder / "journal.txt", reason)
    from nacre.io.atomic import remove_leftovers

    for place in (out, unfinished.folder):
        remove_leftovers(place)
    done = unfinished.resume(sequence, compare=not asked.is_camera)  # its colours were kept as JPEG
    live = unfinished.stage.live
    if live is not None and len(done.frames) < len(unfinished.journaled_indices()):  # since, nobody counted
        unfinished.stage.live = {**live, "num_received": None, "num_dropped": None}
    return Run(asked, out, done, sequence, unfinished, words, indices, None)
