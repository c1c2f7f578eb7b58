"""The command line: ``nacre``. It needs the extra ``cli``."""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the data does not allow it, 2 wrong usage, 130 interrupted."""
    try:
        import rich  # noqa: F401
        import typer  # noqa: F401
    except ImportError as error:
        print(f'error: the command line needs {error.name}: pip install "nacre[cli]"', file=sys.stderr)
        sys.exit(2)
    from nacre.cli.app import run

    for stream in (sys.stdout, sys.stderr):
        # A letter that a terminal lacks, and a file's name that is no text, are shown by their numbers.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    sys.exit(run(arguments))
