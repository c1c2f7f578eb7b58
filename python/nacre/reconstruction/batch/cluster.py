"""The processes that reconstruct: of a Dask cluster on this machine, or of one that is there."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from nacre.system import default_threads

if TYPE_CHECKING:
    from distributed import Client

_SECONDS_TO_CONNECT = 10
# A worker under a nanny has one thread a loop unless its environment says otherwise: here, its share.
_THREADS = "OMP_NUM_THREADS"


def import_distributed() -> Any:
    """Return the package ``distributed``, or say how to install it."""
    try:
        import distributed
    except ImportError as error:
        raise ImportError(
            'many recordings need Dask: pip install "nacre[dask]"', name="distributed"
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
    """
    distributed = import_distributed()
    if scheduler is None:
        with (
            _local_cluster(distributed, workers, num_tasks) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout=_SECONDS_TO_CONNECT)
    except (OSError, TimeoutError) as error:
        raise ConnectionError(
            f"no scheduler answers at {scheduler}: dask scheduler starts one, and prints its address"
        ) from error
    with client:
        _require_processes(client, scheduler)
        yield client


def _local_cluster(distributed: Any, workers: int | None, num_tasks: int) -> Any:
    """Return a cluster that fills the machine: its processors are divided among the workers."""
    num_processors = default_threads()
    num_workers = workers or min(num_processors, num_tasks)
    return distributed.LocalCluster(
        n_workers=num_workers,
        threads_per_worker=1,
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
        env={_THREADS: str(max(1, num_processors // num_workers))},
    )


def _require_processes(client: Client, scheduler: str) -> None:
    for address, worker in client.scheduler_info(n_workers=-1)["workers"].items():
        if worker["nthreads"] != 1:
            command = f"dask worker {scheduler} --nworkers {os.cpu_count()} --nthreads 1"
            raise ValueError(
                f"the worker {address} runs {worker['nthreads']} tasks in one process, and a recording needs "
                f"a process of its own: {command}"
            )
