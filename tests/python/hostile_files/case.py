"""What a hostile case is, and what reads it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nacre
from nacre.cli.align import read_matrix
from nacre.cli.config import model_parameters
from nacre.io.cameras import read_camera
from nacre.io.images import read_attribute, read_color, read_depth
from nacre.io.obj_painting import read_painted
from nacre.io.ply import read_range_grid
from nacre.reconstruction import Reconstruction


@dataclass(frozen=True)
class Case:
    """
    Files, and what must be said of them.

    Attributes
    ----------
    name : str
        FORMAT/WHAT_IT_DOES.
    reader : str
        A key of ``READERS``.
    files : mapping of str to bytes
        By their places in the case's folder.
    message : str
        Pattern of what the error says, its place included.
    opens : str
        The file that is given to the reader; "" gives the folder.
    links : mapping of str to str
        Symbolic links, by their places, and where they point to.
    pipes : tuple of str
        Named pipes, by their places; nobody ever writes to them.
    needs : str
        The module without which the format is not read.
    """

    name: str
    reader: str
    files: Mapping[str, bytes]
    message: str
    opens: str = ""
    links: Mapping[str, str] = field(default_factory=dict)
    pipes: tuple[str, ...] = ()
    needs: str = "numpy"


def single(
    kind: str, reader: str, suffix: str, table: Mapping[str, tuple[bytes | str, str]], **more: str
) -> list[Case]:
    """Return a case for each file of a table: name to content and message."""
    file = f"a{suffix}"
    return [
        Case(f"{kind}/{name.replace(' ', '_')}", reader, {file: as_bytes(content)}, message, file, **more)
        for name, (content, message) in table.items()
    ]


def as_bytes(content: bytes | str) -> bytes:
    """Return what a file holds."""
    return content if isinstance(content, bytes) else content.encode()


def write(case: Case, folder: Path) -> Path:
    """Write the files of a case into a folder of its own, and return what is to be opened."""
    home = folder / case.name
    for name, content in case.files.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_bytes(content)
    for name, target in case.links.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).symlink_to(target)
    for name in case.pipes:
        os.mkfifo(home / name)
    return home / case.opens


def read_recording(path: Path) -> list[Any]:
    """Read every view of a recording."""
    return list(nacre.open_sequence(path))


def read_output(path: Path) -> Any:
    """Read what a reconstruction wrote as the viewer does."""
    from nacre.viewer.saved_timeline import read_timeline

    return read_timeline(path)


def read_run(path: Path) -> Any:
    """Read what an unfinished run left, as ``nacre info`` does."""
    from nacre.cli.info import describe_unfinished

    return describe_unfinished(path)


READERS: dict[str, Callable[[Path], Any]] = {
    "points": nacre.read_points,
    "mesh": nacre.read_mesh,
    "painted mesh": lambda path: read_painted(path / "a.obj"),
    "range grid": read_range_grid,
    "depth": read_depth,
    "color": read_color,
    "attribute": read_attribute,
    "camera": read_camera,
    "trajectory": nacre.read_trajectory,
    "matrix": read_matrix,
    "recording": read_recording,
    "config": lambda path: model_parameters(None, path, None),
    "output": read_output,
    "checkpoint": nacre.Model.load,
    "reconstruction": lambda path: Reconstruction.load(path, []),
    "run": read_run,
}


def opened(case: Case, path: Path) -> Any:
    """Read what :func:`write` wrote."""
    return READERS[case.reader](path)
