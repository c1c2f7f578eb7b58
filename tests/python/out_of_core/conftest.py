"""A cloud on disk, whole and in parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hills import hills, write


@pytest.fixture(scope="session")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a PLY file of hills."""
    return write(tmp_path_factory.mktemp("scan") / "hills.ply", hills())


@pytest.fixture(scope="session")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of files with the same points in another order."""
    folder = tmp_path_factory.mktemp("parts")
    cloud = hills()
    order = np.random.default_rng(9).permutation(len(cloud))
    for number, rows in enumerate(np.split(order, [5_000, 5_001, 17_000])):
        write(folder / f"{number}.ply", cloud[rows])
    return folder
