"""One piece of a recording, as a worker tracks it: by the loop of every run, with a model of its own."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from nacre.errors import FileFormatError, RunError
from nacre.io.atomic import atomic_writer
from nacre.io.json_files import read_json
from nacre.model import Model
from nacre.parameters import ModelParameters
from nacre.reconstruction.known_motions import Poses
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.run_options import RunOptions, may_park
from nacre.reconstruction.saved_state import pose_from
from nacre.system import __version__


@dataclass(frozen=True)
class Piece:
    """What a worker is asked for: frames of a recording."""

    options: RunOptions
    folder: Path  #: that the options' paths begin at
    parameters: ModelParameters
    indices: Sequence[int]
    version: str = __version__  #: of who asks: another one may give other bytes

    @property
    def words(self) -> str:
        """Which frames."""
        return f"frames {self.indices[0]} to {self.indices[-1]}"


def track(piece: Piece) -> Poses:
    """
    Return the poses of a piece's tracked frames by their indices; the world is the piece's own.

    What leaves the model's memory goes to a temporary folder.
    """
    if piece.version != __version__:
        raise RunError(f"a worker has nacre {__version__}, and is asked by {piece.version}")
    sequence = piece.options.open(piece.folder)
    with TemporaryDirectory(prefix="nacre-piece-") as parked:
        folder = parked if may_park(piece.parameters) else None
        model = Model(sequence.camera, parameters=piece.parameters, points_folder=folder)
        done = Reconstruction(sequence, model)
        for _ in done.run(piece.indices):
            pass
        return done.fused_poses


def write_poses(path: Path, poses: Poses) -> None:
    """Keep the poses of a piece."""
    text = json.dumps({str(index): pose.ravel().tolist() for index, pose in poses.items()})
    with atomic_writer(path) as stream:
        stream.write(text.encode())


def read_poses(path: Path) -> Poses:
    """Return what :func:`write_poses` wrote; FileFormatError: the file is damaged."""
    found: Any = read_json(path)
    try:
        return {int(index): pose_from(pose) for index, pose in found.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise FileFormatError(path, f"it does not hold the poses of a piece ({error})") from None
