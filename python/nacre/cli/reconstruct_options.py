"""The options that ``nacre reconstruct`` and ``nacre batch`` share, and what they ask for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.config import model_parameters
from nacre.cli.terminal import CommandError

if TYPE_CHECKING:
    from nacre.parameters import ModelParameters
    from nacre.reconstruction.run_options import RunOptions

CheckpointOption = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="N",
        help="Save the run in OUT/unfinished after every N frames; 0: only where it is stopped.",
        show_default="about 2 % of the time",
    ),
]
MinDepthOption = Annotated[
    float | None, typer.Option(help="Nearer measurements are not used (metres).", show_default=False)
]
MaxDepthOption = Annotated[
    float | None, typer.Option(help="Farther measurements are not used (metres).", show_default=False)
]
BoxOption = Annotated[
    tuple[float, float, float, float, float, float] | None,
    typer.Option(
        metavar="X0 X1 Y0 Y1 Z0 Z1",
        help="Model only what is in this box of the camera's frame (metres; x right, y down, z forward).",
        show_default=False,
    ),
]
ObjectOption = Annotated[
    bool,
    typer.Option("--object", help="Model only the largest thing that stands on a plane, e.g. a turntable."),
]
MasksOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Images named as the depth images; black pixels are not used.",
        show_default="the recording's",
    ),
]
EveryOption = Annotated[int, typer.Option(min=1, metavar="N", help="Use every N-th frame.")]
FirstOption = Annotated[int, typer.Option(min=0, metavar="INDEX", help="The first frame, from 0.")]
LastOption = Annotated[
    int | None, typer.Option(min=0, metavar="INDEX", help="The last frame.", show_default="all")
]
ColorOption = Annotated[bool, typer.Option("--color/--no-color", help="Give the model colours.")]
RetryOption = Annotated[
    bool,
    typer.Option("--retry/--no-retry", help="At the end, try lost frames again while any is found."),
]
LoopClosureOption = Annotated[
    bool | None,
    typer.Option(
        "--loop-closure/--no-loop-closure",
        help="Correct model and poses where the camera comes back to what it saw before.",
        show_default="on",
    ),
]
CalibrateOption = Annotated[
    bool | None,
    typer.Option(
        "--calibrate/--no-calibrate",
        help="Where views in several directions show that depth is systematically wrong, correct it.",
        show_default="on",
    ),
]
DeformOption = Annotated[
    bool,
    typer.Option("--deform", help="What is seen bends: grow its shape at rest, and follow how it is."),
]
AttributeOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=FOLDER",
        help="Images of anything else, named as the depth images; fused along. May be repeated.",
    ),
]
AllPointsOption = Annotated[
    bool,
    typer.Option(
        "--all-points",
        help="Write the points, too, that are no surface: litter, and layers that surer ones cover.",
    ),
]
ReportOption = Annotated[bool, typer.Option("--report/--no-report", help="Write report.html.")]
MinTrackedOption = Annotated[
    float,
    typer.Option(
        min=0, max=1, metavar="PART", help="Exit with 3 where a smaller part of the frames is tracked."
    ),
]


def asked_for(arguments: Mapping[str, Any], **more: Any) -> tuple[RunOptions, ModelParameters]:
    """Return the options of a run and the model's parameters from a command's arguments by their names."""
    from nacre.reconstruction.run_options import RunOptions, changed_parameters

    changes: dict[str, Any] = {
        "depth.min_depth": arguments["min_depth"],
        "depth.max_depth": arguments["max_depth"],
        "loop_closure": arguments["loop_closure"],
        "calibrate_depth": arguments["calibrate"],
        "deform": arguments["deform"] or None,
        "region.object": arguments["object"] or None,
    }
    if arguments["box"] is not None:
        sides = ("min_x", "max_x", "min_y", "max_y", "min_z", "max_z")
        changes |= {f"region.{side}": value for side, value in zip(sides, arguments["box"], strict=True)}
    parameters, preset = model_parameters(
        arguments["preset"], arguments["config"], arguments["settings"], **changes
    )
    options = RunOptions(
        format=arguments["format"],
        camera=_text(arguments["camera"]),
        depth_scale=arguments["depth_scale"],
        masks=_text(arguments["masks"]),
        attribute=arguments["attribute"] or [],
        color=arguments["color"],
        first=arguments["first"],
        last=arguments["last"],
        every=arguments["every"],
        retry=arguments["retry"],
        preset=preset,
        all_points=arguments["all_points"],
        report=arguments["report"],
        min_tracked=_part("--min-tracked", arguments["min_tracked"]),
        parameters=changed_parameters(parameters),
        **more,
    )
    _require_recording(options)
    return options, parameters


def _require_recording(options: RunOptions) -> None:
    """Refuse, for a camera, the options that only recordings have."""
    if not options.is_camera:
        return
    for option, value in (
        ("--format", options.format),
        ("--camera", options.camera),
        ("--depth-scale", options.depth_scale),
        ("--masks", options.masks),
        ("--attribute", options.attribute or None),
        ("--realtime", options.realtime or None),
    ):
        if value is not None:
            raise CommandError(f"{option} is for recordings, and {options.source} is a camera", 2)


def _part(option: str, value: float) -> float:
    if not 0 <= value <= 1:  # NaN, which the parser lets through
        raise CommandError(f"{option} must be 0 to 1, got {value}", 2)
    return value


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
