"""The commands, and what happens to their errors."""

from __future__ import annotations

import logging
import os
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from nacre._internal.signals import Stopped
from nacre.cli.align import align
from nacre.cli.batch import batch
from nacre.cli.consolidate import consolidate
from nacre.cli.convert import convert
from nacre.cli.demo import demo
from nacre.cli.doctor import doctor
from nacre.cli.downsample import downsample
from nacre.cli.evaluate import evaluate
from nacre.cli.info import info
from nacre.cli.mesh import mesh
from nacre.cli.normals import normals
from nacre.cli.outliers import outliers
from nacre.cli.reconstruct import reconstruct
from nacre.cli.record import record
from nacre.cli.simulate import simulate
from nacre.cli.terminal import set_verbosity, warnings_in_log
from nacre.cli.view import view
from nacre.errors import explain, meant


def _version(wanted: bool) -> None:
    if wanted:
        import nacre

        print(f"nacre {nacre.__version__}")
        raise typer.Exit


def _nacre(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Grow a 3D model of an object or a scene from depth-camera images."""


EXAMPLES: dict[Callable[..., None], str] = {
    demo: "nacre demo -o nacre-demo",
    reconstruct: "nacre reconstruct rgbd_dataset_freiburg3_teddy -o teddy",
    record: "nacre record realsense -o kitchen",
    batch: 'nacre batch "scans/*" -o models',
    view: "nacre view teddy",
    mesh: "nacre mesh teddy -o teddy.glb",
    convert: "nacre convert teddy/model.ply teddy.las",
    simulate: (
        "nacre simulate bunny.ply -o bunny-recording --views 12 --step 30 --noise 0.0005 --orthographic"
    ),
    evaluate: "nacre evaluate out/model.ply bunny.ply",
    align: "nacre align scan2.ply scan1.ply -o moved.ply",
    consolidate: "nacre consolidate noisy.ply thin.ply --radius 0.008 --num-points 2000",
    normals: "nacre normals scan.las normals.ply --memory 2GB",
    downsample: "nacre downsample scans thin.laz --voxel-size 0.05 --memory 2GB",
    outliers: "nacre outliers scan.laz clean.laz",
    info: "nacre info rgbd_dataset_freiburg3_teddy",
    doctor: "nacre doctor --json",
}


def make_app(only: str | None = None) -> typer.Typer:
    """Return the command line; with ``only`` the other commands are there by name and summary alone."""
    app = typer.Typer(
        name="nacre",
        no_args_is_help=True,
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(
        epilog="New here? Run [bold]nacre demo[/bold]. Every command explains itself: nacre COMMAND --help."
    )(_nacre)
    for command, example in EXAMPLES.items():
        paragraphs = (" ".join(text.split()) for text in (command.__doc__ or "").split("\n\n"))
        app.command(
            command.__name__,
            help="\n\n".join(paragraphs),
            epilog=f"Example: [bold]{example}[/bold]",
            no_args_is_help=command not in (demo, doctor),
        )(command if only in (None, command.__name__) else _not_asked_for)
    return app


def _not_asked_for() -> None:
    """Stand for a command in the list of commands: typer takes ten milliseconds to build a real one."""


app = make_app()


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; whatever goes wrong is told in one line."""
    set_verbosity(0)
    words = sys.argv[1:] if arguments is None else arguments
    command = next((word for word in words if not word.startswith("-")), "")
    try:
        wanted = app if "_NACRE_COMPLETE" in os.environ else make_app(only=command)
        with warnings_in_log():
            return wanted(arguments, prog_name="nacre", standalone_mode=False) or 0
    except Stopped as stopped:
        print("error: stopped", file=sys.stderr)
        return 128 + stopped.number
    except Exception as error:
        message, code = _explain(error)
        if message:
            print(f"error: {message}", file=sys.stderr)
        if logging.getLogger("nacre").isEnabledFor(logging.DEBUG):
            traceback.print_exception(error)
        return code
    finally:
        set_verbosity(None)


def _explain(error: Exception) -> tuple[str, int]:
    """Return what to say about an error, the parser's ones included, and the exit code."""
    if type(error).__name__ == "Abort":  # the parser's for Ctrl-C
        return "stopped", 130
    if not hasattr(error, "format_message"):
        return explain(error)
    context = getattr(error, "ctx", None)
    message = error.format_message().replace("Value error, ", "")
    if type(error).__name__ == "NoArgsIsHelpError":
        print(message)
        return "", 0 if context is not None and context.parent is None else 2
    hint = f" (see {context.command_path} --help)" if context is not None else ""
    choice = re.search(r"(\S+) is not one of (.+)", message)
    near = meant(choice[1].strip("'"), re.findall(r"'([^']+)'", choice[2])) if choice else ""
    return message.rstrip(".") + near + hint, 2
