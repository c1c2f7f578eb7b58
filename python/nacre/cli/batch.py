"""``nacre batch``: many recordings become models, each in its folder."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nacre._internal.signals import Stopped, interruptible
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
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption, option_words
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, table

if TYPE_CHECKING:
    from nacre.reconstruction.batch.index import Index
    from nacre.reconstruction.batch.result import BatchResult


def batch(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE...",
            help="Recordings, folders of them, patterns in quotes, or @list.txt: a file with one a line.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", metavar="OUT", help="Folder for the results.", show_default=False),
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="So many processes on this machine, which share its processors.",
            show_default="one for each processor",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="A Dask scheduler whose workers do it, e.g. tcp://10.0.0.1:8786; all see the same disk.",
            show_default=False,
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Do again what is there with other options, or damaged.")
    ] = False,
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
    color: ColorOption = True,
    retry: RetryOption = True,
    loop_closure: LoopClosureOption = None,
    calibrate: CalibrateOption = None,
    deform: DeformOption = False,
    attribute: AttributeOption = None,
    all_points: AllPointsOption = False,
    report: ReportOption = True,
    min_tracked: MinTrackedOption = 0.5,
    preset: PresetOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Make models from many recordings, each by a process of its own.

    Options are those of nacre reconstruct; folders of --masks and --attribute are inside each recording. Each
    recording gets OUT/NAME with all that nacre reconstruct writes, and the same bytes; NAME is that of its
    folder or file, with its parents' before it where two would be the same.

    Run again, what is finished is left as it is, and what was killed goes on. A recording that fails is told,
    and stops nothing. OUT/index.html and OUT/index.json tell of all, and link to each report.

    Exit codes: 1 where a recording failed or was not done, 3 where fewer than --min-tracked of the frames of
    one were tracked. Needs Dask: pip install "nacre[dask]".
    """
    arguments = locals()
    terminal = Terminal(json, quiet, verbose)
    from nacre.io.writable_folder import writable_folder
    from nacre.reconstruction.batch.run import BatchRun
    from nacre.reconstruction.batch.sources import find_recordings
    from nacre.reconstruction.batch.task import make_tasks

    options, parameters = asked_for(arguments, source="")
    tasks = make_tasks(
        find_recordings(sources),
        options,
        parameters,
        out,
        overwrite=overwrite,
        checkpoint_every=checkpoint_every,
    )
    run = BatchRun(tasks, writable_folder(out), workers, scheduler)
    with interruptible() as stop:
        try:
            with stop.at_once(), closing(run.results()) as results:
                _follow(terminal, results, len(tasks))
        except Stopped:
            _tell(terminal, out, run.index)
            raise typer.Exit(stop.exit_code) from None
    _tell(terminal, out, run.index)
    _complain(run.index.results)


def _follow(terminal: Terminal, results: Iterable[BatchResult], total: int) -> None:
    """Tell of each result when it is there, and how long the others will take."""
    from nacre.run_data.text import duration

    start, num_reconstructed = time.monotonic(), 0
    with terminal.progress("recordings", total) as advance:
        for number, result in enumerate(results, 1):
            num_reconstructed += result.outcome != "finished before"
            left = (total - number) * (time.monotonic() - start) / max(1, num_reconstructed)
            more = f" (about {duration(left)} left)" if number < total and num_reconstructed else ""
            words = (result.verdict if result.has_results else option_words(result.message)).removesuffix(".")
            terminal.say(f"{number} of {total}: {result.name}: {result.outcome}: {words}{more}")
            advance(result.name)


def _tell(terminal: Terminal, out: Path, index: Index) -> None:
    """Print what became of all."""
    from nacre.reconstruction.batch.sources import INDEX_FILE, INDEX_PAGE

    if terminal.json:
        from nacre.io.json_files import to_json

        print(to_json(index.as_dict()))
    counts = Counter(result.outcome for result in index.results)
    rows = [(outcome, str(number)) for outcome, number in counts.items()]
    terminal.say(table([*rows, ("table", str(out / INDEX_PAGE)), ("figures", str(out / INDEX_FILE))]))
    if counts["not done"]:
        terminal.say("the same command again goes on")


def _complain(results: Sequence[BatchResult]) -> None:
    """Raise what went wrong, when all that could be done is done."""
    failed = [result for result in results if result.outcome == "failed"]
    missing = sum(result.outcome == "not done" for result in results)
    if failed:
        first = f"{failed[0].name}: {failed[0].message}"
        more = f"; and {len(failed) - 1} more" if len(failed) > 1 else ""
        raise CommandError(f"{len(failed)} of {len(results)} recordings failed: {first}{more}")
    if missing:
        raise CommandError(
            f"{missing} of {len(results)} recordings are not done, for the scheduler went away: "
            "the same command again goes on"
        )
    few = [result for result in results if result.message]
    if few:
        raise CommandError(
            f"{len(few)} of {len(results)} recordings lack frames: {few[0].name}: {few[0].message}",
            3,
        )
