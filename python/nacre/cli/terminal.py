"""What a command says: results on stdout, progress, log and errors on stderr."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from nacre.errors import RunError

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no summary, no warnings.")]
Verbose = Annotated[
    int, typer.Option("--verbose", "-v", count=True, show_default=False, help="Say more; twice: everything.")
]


class CommandError(RunError):
    """An error of a command, which is told in one line."""


class _Format(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return f"{record.levelname.lower()}: {record.getMessage()}"


def set_verbosity(level: int | None) -> None:
    """Send the log to stderr: -1 errors, 0 warnings, 1 information, 2 everything; None: no longer."""
    logger = logging.getLogger("nacre")
    for handler in [h for h in logger.handlers if isinstance(h.formatter, _Format)]:
        logger.removeHandler(handler)
    if level is None:
        logger.setLevel(logging.NOTSET)
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Format())
    logger.addHandler(handler)
    levels = (logging.ERROR, logging.WARNING, logging.INFO, logging.DEBUG)
    logger.setLevel(levels[max(-1, min(level, 2)) + 1])


@contextmanager
def warnings_in_log() -> Iterator[None]:
    """Tell in the log what nacre and others warn of, in a line of its own."""

    def tell(message: Warning | str, *_: Any, **__: Any) -> None:
        logging.getLogger("nacre").warning("%s", message)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = tell
        yield


class Terminal:
    """How one run of a command talks."""

    def __init__(self, json: bool = False, quiet: bool = False, verbose: int = 0) -> None:
        self.json = json
        self.quiet = quiet
        set_verbosity(-1 if quiet else verbose)

    def say(self, text: str = "") -> None:
        """Print a line that a person likes to see but that is not the command's answer."""
        if not (self.json or self.quiet):
            print(text, flush=True)  # a program that reads it may wait for it

    def answer(self, figures: Mapping[str, Any], rows: Sequence[tuple[str, str]]) -> None:
        """Print what the command is for: as JSON, or as lines of a name and a value."""
        if self.json:
            from nacre.io.json_files import to_json

            print(to_json(figures))
        else:
            print(table(rows))

    @contextmanager
    def progress(self, description: str, total: int | None) -> Iterator[Callable[[str], None]]:
        """Show a bar on stderr, where that is a terminal; yields what advances it. None: nobody knows."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda note: None
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
        )
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task(description, total=total, note="")
            yield lambda note: bar.update(task, advance=1, note=note)


def table(rows: Sequence[tuple[str, str]]) -> str:
    """Return names and values in two columns."""
    width = max((len(name) for name, _ in rows), default=0)
    return "\n".join(f"{name:<{width}}  {value}".rstrip() for name, value in rows)


def written_file(folder: Path, name: str) -> Path:
    """Return a file that ``nacre reconstruct`` writes, or say that this is not one of its folders."""
    path = folder / name
    if not path.is_file():
        what = f"{folder} has no {name}" if folder.is_dir() else f"there is no folder {folder}"
        raise CommandError(f"{what}; give the folder that nacre reconstruct wrote to (its -o)", 2)
    return path


def writable_file(path: Path) -> Path:
    """Say at once that a file cannot be written."""
    import tempfile

    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise CommandError(f"cannot write {path}: {error.strerror}", 2) from error
    if path.is_dir():
        raise CommandError(f"cannot write {path}: it is a folder", 2)
    return path
