"""``nacre view``: what a reconstruction wrote, in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from nacre.cli.terminal import CommandError, Quiet, Terminal, Verbose, table, written_file

PortOption = Annotated[
    int, typer.Option(min=0, max=65535, metavar="PORT", help="Where the viewer listens; the next free one.")
]


def view(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="What nacre reconstruct wrote, or a file of points or a mesh; of any size: .copc.laz.",
            show_default=False,
        ),
    ],
    compare: Annotated[
        Path | None,
        typer.Option(metavar="OTHER", help="Another run of the same scene, or points.", show_default=False),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write a page that opens without a server instead.", show_default=False
        ),
    ] = None,
    rrd: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a file for the Rerun viewer instead.", show_default=False),
    ] = None,
    port: PortOption = 8080,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Look at a reconstruction in the browser.

    The page shows the model as points or as a mesh, coloured as seen or by shading, normal, uncertainty or
    age, measures distances, crops and saves points, hides those of large uncertainty, and plays how the model
    grew, and how it moved in a run with --deform; with --compare also how far two runs are apart, after the
    other is brought into the frame of the first where frames differ. --rrd needs the extra "rerun".
    """
    terminal = Terminal(False, quiet, verbose)
    from nacre.run_data.text import count
    from nacre.viewer import Viewer, export_html, export_rrd, in_frame_of, read_timeline
    from nacre.viewer.page_data import kept_points

    if rrd is not None and compare is not None:
        raise CommandError("--rrd writes one run: leave out --compare", 2)
    sources = [folder] if compare is None else [folder, compare]
    for source in sources:
        if not source.is_file():
            written_file(source, "report.json")
    timeline, *others = map(read_timeline, sources)
    other = others[0] if others else None
    if other is not None:
        timeline.title, other.title = (source.name for source in sources)
        other = in_frame_of(timeline, other)
        terminal.say(f"{other.title}: {other.placement}")
    if html is not None:
        export_html(timeline, html, other=other)
        shown = [("page", str(html))]
        for one in (timeline, *([] if other is None else [other])):
            kept, total = kept_points(one), one.num_points
            if kept < total:
                told = f"{count(kept)} of {count(total)}, evenly: a page without a server has no more"
                shown.append(("points", told))
        terminal.say(table(shown))
    if rrd is not None:
        export_rrd(timeline, rrd)
        terminal.say(table([("Rerun", str(rrd))]))
    if html is not None or rrd is not None:
        return
    viewer = Viewer(timeline, other=other, port=port)
    terminal.say(f"the model is at {viewer.url}; Ctrl-C ends it")
    viewer.wait()
    viewer.close()
