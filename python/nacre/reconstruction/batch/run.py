"""A batch is run: its recordings are given to workers, and their results come as they are done."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from nacre._internal.cluster import cluster_client, import_distributed
from nacre.errors import explain
from nacre.io.atomic import remove_leftovers
from nacre.io.folder_lock import lock_folder
from nacre.reconstruction.batch.index import Index
from nacre.reconstruction.batch.result import BatchResult, failed
from nacre.reconstruction.batch.task import Task, reconstruct_recording

if TYPE_CHECKING:
    from distributed import Client, Future

_RETRIES = 2  # where a disk is full or memory is short, elsewhere or a moment later it may not be


class BatchRun:
    """
    The recordings of a batch, and what became of them.

    Parameters
    ----------
    tasks : sequence of Task
        One for each recording.
    output : Path
        The folder of the results.
    workers : int, optional
        How many local processes; None: one for each processor.
    scheduler : str, optional
        The address of a Dask scheduler that is there, in place of local processes.

    Attributes
    ----------
    index : Index
        The results up to now.
    """

    def __init__(
        self, tasks: Sequence[Task], output: Path, workers: int | None = None, scheduler: str | None = None
    ) -> None:
        self.index = Index(output, [task.empty_result for task in tasks])
        self._tasks = tasks
        self._output = output
        self._workers = workers
        self._scheduler = scheduler

    def results(self) -> Generator[BatchResult, None, None]:
        """Reconstruct, and yield each result when it is there."""
        import_distributed()
        self._output.mkdir(parents=True, exist_ok=True)
        with self._lock(), cluster_client(self._scheduler, self._workers, len(self._tasks)) as client:
            remove_leftovers(self._output)
            self.index.write()
            try:
                yield from self._results_of(client)
            finally:
                self.index.write()

    def _results_of(self, client: Client) -> Generator[BatchResult, None, None]:
        from distributed import as_completed

        futures = client.map(reconstruct_recording, self._tasks, pure=False, retries=_RETRIES)
        tasks = {future.key: task for future, task in zip(futures, self._tasks, strict=True)}
        for future in as_completed(futures):
            result = _result_of(future, tasks[future.key])
            future.release()
            self.index.add(result)
            yield result

    @contextmanager
    def _lock(self) -> Iterator[None]:
        """Keep other batches from writing to the folder."""
        try:
            lock = lock_folder(self._output)
        except BlockingIOError as error:
            reason = "another nacre batch is writing to it"
            raise BlockingIOError(error.errno, reason, os.fspath(self._output)) from None
        try:
            yield
        finally:
            if lock is not None:
                os.close(lock)


def _result_of(future: Future[BatchResult], task: Task) -> BatchResult:
    """Return what a worker found, or why it found nothing."""
    from distributed import CancelledError, KilledWorker

    result = task.empty_result
    try:
        found: BatchResult = future.result()
    except CancelledError:
        return dataclasses.replace(result, message="the scheduler went away")
    except KilledWorker:
        reason = "its worker died, and so did those that tried it again: is there enough memory?"
        return failed(result, reason)
    except Exception as error:
        return failed(result, f"{explain(error)[0]}; the same command again goes on with it")
    if found.has_results and not found.folder.is_dir():
        reason = f"the worker wrote to {found.folder}, which is not seen here: all machines need one disk"
        return failed(result, reason)
    return found
