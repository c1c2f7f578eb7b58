"""``nacre reconstruct``: a recording becomes a model."""

from __future__ import annotations

from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated

import typer

from nacre._internal.camera_names import CAMERAS, is_camera
from nacre._internal.signals import interruptible
from nacre.cli.config import ConfigOption, PresetOption, SetOption
from nacre.cli.reconstruct_options import (
    AllPointsOption,
    AttributeOption,
    BoxOption,
    CalibrateOption,
    CheckpointOption,
    ColorOption,
    DeformOption,
    EveryOption,
    FirstOption,
    LastOption,
    LoopClosureOption,
    MasksOption,
    MaxDepthOption,
    MinDepthOption,
    MinTrackedOption,
    ObjectOption,
    ReportOption,
    RetryOption,
    asked_for,
)
from nacre.cli.run import carry_out
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption, in_option_words
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
    checkpoint_every: CheckpointOption = None,
    format: FormatOption = None,
    camera: CameraOption = None,
    depth_scale: DepthScaleOption = None,
    min_depth: MinDepthOption = None,
    max_depth: MaxDepthOption = None,
    box: BoxOption = None,
    object: ObjectOption = False,
    masks: MasksOption = None,
    every: EveryOption = 1,
    first: FirstOption = 0,
    last: LastOption = None,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime", help="Play the recording as a camera would; frames that come too fast are dropped."
        ),
    ] = False,
    color: ColorOption = True,
    retry: RetryOption = True,
    loop_closure: LoopClosureOption = None,
    calibrate: CalibrateOption = None,
    deform: DeformOption = False,
    attribute: AttributeOption = None,
    all_points: AllPointsOption = False,
    report: ReportOption = True,
    min_tracked: MinTrackedOption = 0.5,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Cut the recording into pieces, which so many processes on this machine track at once.",
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="The same by the workers of a Dask scheduler, e.g. tcp://10.0.0.1:8786; all see one disk.",
            show_default=False,
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

    A camera runs until Ctrl-C or --last, and OUT/recording keeps what was used; nacre record has a window.
    Where frames come faster than they can be registered, the oldest are dropped and counted.

    OUT gets model.ply (points with normals, in the first camera's frame), trajectory.txt, report.json and
    report.html; with --deform, animation.glb, too: how it moved. A frame that cannot be read or registered
    is LOST and changes nothing. Where fewer than --min-tracked of the frames are tracked, all is written,
    and the exit code is 3.
    The frames may be far apart and in any order: a lost camera is searched for everywhere.

    Ctrl-C (and SIGTERM) saves the run and writes what there is; --resume OUT goes on with it, and with one
    that was killed, to the same model. OUT/unfinished is there as long as a run is not finished.
    """
    arguments = locals()
    terminal = Terminal(json, quiet, verbose)
    from nacre.reconstruction.job import begin_run, resume_run
    from nacre.reconstruction.pieces.workers import Cluster
    from nacre.reconstruction.resume import UnfinishedRun

    window = _window(port) if view else None
    cluster = Cluster(workers, scheduler)
    controls = window.controls if window else None
    with interruptible() as stop, ExitStack() as ends:
        if resume is not None:
            _refuse_more_options(context, resume)
            unfinished = ends.enter_context(closing(UnfinishedRun(resume, checkpoint_every)))
            with in_option_words():
                job = resume_run(unfinished, cluster)
        else:
            if source is None or out is None:
                missing = "argument 'SOURCE'" if source is None else "option '--out' / '-o'"
                raise CommandError(f"missing {missing} (see nacre reconstruct --help)", 2)
            unfinished = ends.enter_context(closing(UnfinishedRun(out, checkpoint_every)))
            options, parameters = asked_for(
                arguments,
                source=str(source),
                realtime=realtime,
                is_camera=is_camera(source),
                pieces=workers is not None or scheduler is not None,
            )
            with in_option_words():
                job = begin_run(options, unfinished, parameters, stop, cluster, controls)
        carry_out(terminal, job, stop, window)


def _window(port: int) -> Window:
    from nacre.viewer import Controls

    return Window(port, Controls("recording"))


def _refuse_more_options(context: typer.Context, out: Path) -> None:
    allowed = {"resume", "checkpoint_every", "workers", "scheduler", "view", "port"}
    allowed |= {"json", "quiet", "verbose"}
    for name in context.params:
        if name not in allowed and str(context.get_parameter_source(name)).endswith("COMMANDLINE"):
            option = "SOURCE" if name == "source" else "--" + name.replace("_", "-")
            raise CommandError(f"--resume takes everything from {out / 'unfinished'}: leave out {option}", 2)
