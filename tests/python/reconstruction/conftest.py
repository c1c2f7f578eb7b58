"""A cluster for what works on one."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture(scope="module", name="cluster")
def two_workers() -> Iterator[Any]:
    """Return a cluster of two processes, as somebody else may have started it."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
    ) as cluster:
        yield cluster
