"""The C++ tests, built and run."""

from collections.abc import Callable
from pathlib import Path

import pytest

TESTS = sorted((Path(__file__).parents[1] / "cpp").glob("test_*.cpp"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [path.stem for path in TESTS])
def test_cpp(name: str, static_build: Path, run: Callable[..., str]) -> None:
    assert "SUCCESS!" in run(static_build / "tests" / "cpp" / name)
