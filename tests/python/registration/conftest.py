"""The clouds that are registered."""

import pytest
from known_motions import Array, sampled


@pytest.fixture(scope="module")
def cloud() -> tuple[Array, Array]:
    return sampled(4000, 1)


@pytest.fixture(scope="module")
def resampled() -> tuple[Array, Array]:
    """Other points of the same surface."""
    return sampled(3000, 2)
