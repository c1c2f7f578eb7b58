"""Workers that track the pieces of a recording, and what they have found."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nacre._internal.cluster import cluster_client, import_distributed
from nacre.errors import FileFormatError
from nacre.reconstruction.known_motions import Poses
from nacre.reconstruction.pieces.track import Piece, read_poses, track, write_poses

_log = logging.getLogger(__name__)
_RETRIES = 2  # where memory is short, elsewhere or a moment later it may not be


@dataclass(frozen=True)
class Cluster:
    """
    Who works: local processes, or the workers of a scheduler.

    Attributes
    ----------
    workers : int or None
        How many local processes; None: one for each processor.
    scheduler : str or None
        The address of a Dask scheduler that is there, in place of local processes.
    """

    workers: int | None = None
    scheduler: str | None = None


class Workers:
    """
    The pieces of a recording, each tracked by a process of a Dask cluster.

    Parameters
    ----------
    pieces : sequence of Piece
        What is to be tracked.
    folder : Path, optional
        What has been found is kept here, and not asked for again.
    cluster : Cluster
        Who works.
    """

    def __init__(self, pieces: Sequence[Piece], folder: Path | None, cluster: Cluster) -> None:
        self.pieces = pieces
        self._folder = folder
        self._cluster = cluster
        self._found: dict[int, Poses] = {}
        self._futures: dict[int, Any] = {}

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Track what has not been tracked yet, while this lasts."""
        self._found |= self._kept()
        missing = [number for number in range(len(self.pieces)) if number not in self._found]
        if not missing:
            yield
            return
        import_distributed()
        with cluster_client(self._cluster.scheduler, self._cluster.workers, len(missing)) as client:
            for priority, number in enumerate(missing):
                future = client.submit(
                    track, self.pieces[number], pure=False, retries=_RETRIES, priority=-priority
                )
                self._futures[number] = future
                if self._folder is not None:
                    future.add_done_callback(lambda future, number=number: self._keep(number, future))
            try:
                yield
            finally:
                self._futures.clear()

    def poses(self, number: int) -> Poses:
        """
        Return what a piece's worker has found, when it has.

        Raises
        ------
        ConnectionError
            The scheduler went away, or worker after worker died.
        """
        if number not in self._found:
            self._found[number] = self._result(number)
        return self._found[number]

    def _result(self, number: int) -> Poses:
        from distributed import CancelledError, KilledWorker

        piece = self.pieces[number]
        try:
            poses: Poses = self._futures[number].result()
        except CancelledError as error:
            raise ConnectionError(f"the scheduler went away before {piece.words} were tracked") from error
        except KilledWorker as error:
            raise ConnectionError(
                f"the worker that tracked {piece.words} died, and so did those that tried it again: is there "
                "enough memory?"
            ) from error
        self._write(number, poses)
        return poses

    def _path(self, number: int) -> Path | None:
        return None if self._folder is None else self._folder / f"piece-{number:05}.json"

    def _kept(self) -> dict[int, Poses]:
        """Return what was found before a run was interrupted."""
        kept = {}
        for number in range(len(self.pieces)):
            path = self._path(number)
            if path is not None and path.exists():
                try:
                    kept[number] = read_poses(path)
                except FileFormatError as error:
                    _log.warning("%s: these frames are tracked again", error)
        return kept

    def _keep(self, number: int, future: Any) -> None:
        """Write what was found at once: it may not be asked for before the run is interrupted."""
        if future.status == "finished" and number not in self._found:
            self._write(number, future.result())

    def _write(self, number: int, poses: Poses) -> None:
        path = self._path(number)
        if path is not None and path.parent.is_dir() and not path.exists():
            write_poses(path, poses)
