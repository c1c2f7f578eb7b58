"""Where pieces say that the camera was; they come while it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np

from nacre.parameters import ModelParameters
from nacre.reconstruction.known_motions import Place, Poses
from nacre.reconstruction.pieces.cut import PIECE, SHARED, cut
from nacre.reconstruction.pieces.joint import joint
from nacre.reconstruction.pieces.track import Piece
from nacre.reconstruction.pieces.workers import Cluster, Workers
from nacre.reconstruction.run_options import RunOptions


class PieceMotions:
    """
    Places frames by the motions of the pieces that have tracked them.

    The first piece of a recording is not among them: it is the beginning of the run itself.

    Parameters
    ----------
    workers : Workers
        Give the poses of each piece.

    Attributes
    ----------
    reach : int
        How many of the newest frames :meth:`place` wants to know.
    """

    reach = PIECE

    def __init__(self, workers: Workers) -> None:
        self._workers = workers

    @classmethod
    def of(
        cls,
        options: RunOptions,
        parameters: ModelParameters,
        indices: Sequence[int],
        *,
        folder: Path,
        kept_in: Path | None,
        cluster: Cluster,
    ) -> PieceMotions:
        """
        Return what the workers of a cluster will find out about frames of a recording.

        Parameters
        ----------
        options : RunOptions
            Which recording; their paths begin at ``folder``.
        parameters : ModelParameters
            Of each piece's model.
        indices : sequence of int
            The frames.
        folder : Path
        kept_in : Path, optional
            Where pieces that are done are kept, for a run that is interrupted.
        cluster : Cluster
        """
        pieces = [Piece(options, folder, parameters, part) for part in cut(indices)[1:]]
        return cls(Workers(pieces, kept_in, cluster))

    def at_work(self) -> AbstractContextManager[None]:
        """While this lasts the workers track."""
        return self._workers.at_work()

    def place(self, index: int, placed: Poses) -> Place | None:
        """
        Return where a frame is to be; None: only registration can tell.

        A piece lies as the frames say that it shares with what is placed, in the mean. One registration
        confirms that; it alone would hand its error on to the whole piece. From then on each frame follows
        the one before, wherever that has been moved to. It depends on the frames alone: a run that was
        interrupted goes on alike.
        """
        for number, piece in enumerate(self._workers.pieces):
            if index not in piece.indices:
                continue
            poses = self._workers.poses(number)
            shared = sorted(poses.keys() & placed.keys())
            if index not in poses or not shared:
                continue
            own = [i for i in shared if i not in piece.indices[:SHARED]]
            goes_on = len(own) > 1
            world_from_piece = (
                placed[own[-1]] @ np.linalg.inv(poses[own[-1]]) if goes_on else joint(placed, poses)
            )
            assert world_from_piece is not None
            return Place(world_from_piece @ poses[index], is_first=not own)
        return None
