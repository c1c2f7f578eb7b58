"""Processes that work: of a Dask cluster on this machine, or of one that is there."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from nacre.system import default_threads

if TYPE_CHECKING:
    from distributed import Client

_log = logging.getLogger("nacre.cluster")

_SECONDS_TO_CONNECT = 10
# A worker has one thread for each of its loops unless its environment says otherwise: here, its share.
_THREADS = "OMP_NUM_THREADS"


def import_distributed() -> Any:
    """Return the package ``distributed``, or say how to install it."""
    try:
        import distributed
    except ImportError as error:
        raise ImportError(
            'several processes need Dask: pip install "nacre[dask]"', name="distributed"
        ) from error
    return distributed


@contextmanager
def cluster_client(scheduler: str | None, workers: int | None, num_tasks: int) -> Iterator[Client]:
    """
    Connect to a scheduler; None: to one of this process with local workers, which end with it.

    Raises
    ------
    ImportError
        Dask is missing.
    ConnectionError
        Nobody answers at the address.
    ValueError
        A worker there runs several tasks in one process.
    RuntimeError
        The local processes did not start.
    """
    distributed = import_distributed()
    from distributed.utils import silence_logging_cmgr

    with ExitStack() as ends:
        ends.enter_context(silence_logging_cmgr(logging.CRITICAL))
        if scheduler is None:
            cluster = ends.enter_context(_local_cluster(distributed, workers, num_tasks))
            _log.info("%d workers; dashboard: %s", len(cluster.workers), cluster.dashboard_link)
            yield ends.enter_context(distributed.Client(cluster))
            return
        try:
            client = ends.enter_context(distributed.Client(scheduler, timeout=_SECONDS_TO_CONNECT))
        except (OSError, TimeoutError, ValueError) as error:
            raise ConnectionError(
                f"no scheduler answers at {scheduler}: dask scheduler starts one, and prints its address"
            ) from error
        _look_at_workers(client, scheduler)
        yield client


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C to the process that started this one, which ends it; Dask calls this in each worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _local_cluster(distributed: Any, workers: int | None, num_tasks: int) -> Any:
    """Return a cluster that fills the machine: its processors are divided among the workers."""
    num_processors = default_threads()
    num_workers = workers or min(num_processors, num_tasks)
    try:
        return distributed.LocalCluster(
            n_workers=num_workers,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
            preload=__name__,
            env={_THREADS: str(max(1, num_processors // num_workers))},
        )
    except RuntimeError as error:
        raise RuntimeError(
            "the processes did not start: a script must call what starts them below "
            'if __name__ == "__main__":, for they import it'
        ) from error


def _look_at_workers(client: Client, scheduler: str) -> None:
    """Say where workers are missing, and refuse those that run several tasks in one process."""
    found = client.scheduler_info(n_workers=-1)["workers"]
    command = f"dask worker {scheduler} --nworkers {os.cpu_count()} --nthreads 1"
    if not found:
        _log.warning("the scheduler has no workers yet: %s starts some", command)
    for address, worker in found.items():
        if worker["nthreads"] != 1:
            raise ValueError(
                f"the worker {address} runs {worker['nthreads']} tasks in one process, and each task needs "
                f"a process of its own: {command}"
            )
