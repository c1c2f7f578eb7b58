"""``nacre record``: a camera's frames become a recording and a model, before one's eyes."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from nacre._internal.camera_names import CAMERAS, is_camera
from nacre._internal.signals import interruptible
from nacre.cli.config import ConfigOption, PresetOption, SetOption, model_parameters
from nacre.cli.reconstruct_options import (
    ColorOption,
    DeformOption,
    MaxDepthOption,
    MinDepthOption,
    ObjectOption,
    ReportOption,
)
from nacre.cli.run import carry_out
from nacre.cli.source import in_option_words
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose
from nacre.cli.view import PortOption
from nacre.cli.window import Window, has_browser


def record(
    camera: Annotated[
        Path,
        typer.Argument(
            metavar="CAMERA",
            help=f"{CAMERAS}; or a recording, which is played as its camera saw it.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="OUT", help="Folder for the results.", show_default=False)
    ],
    min_depth: MinDepthOption = None,
    max_depth: MaxDepthOption = None,
    object: ObjectOption = False,
    color: ColorOption = True,
    deform: DeformOption = False,
    last: Annotated[
        int | None,
        typer.Option(min=0, metavar="INDEX", help="The last frame, from 0.", show_default="when stopped"),
    ] = None,
    window: Annotated[
        bool, typer.Option("--window/--no-window", help="Open a window; without, it begins at once.")
    ] = True,
    report: ReportOption = True,
    port: PortOption = 8080,
    preset: PresetOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Record a depth camera, and watch its model grow.

    A window opens in the browser: what the camera sees, the model, and the holes in it; buttons start, pause
    and stop. Ctrl-C stops, too. Without a browser recording begins at once, and the same page is there to be
    opened from elsewhere; with --no-window there is none.

    OUT gets what nacre reconstruct writes, and OUT/recording keeps the frames: nacre reconstruct
    OUT/recording goes over them again, with other options. A camera that is unplugged loses nothing of that.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre.reconstruction.job import begin_run
    from nacre.reconstruction.resume import UnfinishedRun
    from nacre.reconstruction.run_options import RunOptions, changed_parameters

    parameters, preset_name = model_parameters(
        preset,
        config,
        settings,
        **{
            "depth.min_depth": min_depth,
            "depth.max_depth": max_depth,
            "region.object": object or None,
            "deform": deform or None,
        },
    )
    is_live = is_camera(camera)
    if not (is_live or camera.exists()):
        raise CommandError(f"there is no camera or recording {camera}; cameras are {CAMERAS}", 2)
    options = RunOptions(
        str(camera),
        color=color,
        last=last,
        realtime=not is_live,
        preset=preset_name,
        is_camera=is_live,
        report=report,
        parameters=changed_parameters(parameters),
    )
    place = _window(waits=is_live, port=port) if window else None
    with interruptible() as stop, closing(UnfinishedRun(out)) as unfinished:
        with in_option_words():
            job = begin_run(options, unfinished, parameters, stop, controls=place.controls if place else None)
        if place and not place.opens:
            terminal.say("no window: there is no browser, or no display; recording begins, Ctrl-C stops it")
        carry_out(terminal, job, stop, place)


def _window(*, waits: bool, port: int) -> Window:
    from nacre.viewer import Controls

    opens = has_browser()
    return Window(port, Controls("ready" if waits and opens else "recording"), opens=opens, stays=opens)
