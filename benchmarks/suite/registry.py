"""All workloads."""

from __future__ import annotations

from suite.workload import Workload
from suite.workloads import (
    consolidation,
    depth,
    loop,
    neighbors,
    normals,
    recordings,
    registration,
)


def all_workloads() -> dict[str, Workload]:
    """Return every workload by name, in the order of the report."""
    modules = (neighbors, normals, registration, consolidation, depth, loop, recordings)
    return {workload.name: workload for module in modules for workload in module.WORKLOADS}
