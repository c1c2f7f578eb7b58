"""What all tests share: where things are, and the C++ library, built once for the session."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import hypothesis
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(Path(__file__).parent))  # for what tests share

RECORDINGS = ROOT.parent / "shared" / "data"

hypothesis.settings.register_profile("nacre", derandomize=True, deadline=None, database=None)
hypothesis.settings.load_profile("nacre")


def pytest_report_header() -> str:
    """Say what is tested, and on top of what."""
    return f"nacre {importlib.metadata.version('nacre')}, numpy {np.__version__}"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests that need recordings where there are none."""
    if not RECORDINGS.is_dir():
        for item in items:
            if item.get_closest_marker("data"):
                item.add_marker(pytest.mark.skip(reason="no recordings in ../shared/data"))


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Return the folder of the real recordings; only for tests marked ``data``."""
    return RECORDINGS


def run_program(*command: str | Path, cwd: Path | None = None, **environment: str) -> str:
    """Run a program and return what it printed; a failure shows all of it."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        words = " ".join(str(word) for word in command)
        pytest.fail(f"{words}\nreturned {done.returncode}:\n{done.stdout}", pytrace=False)
    return done.stdout


@pytest.fixture(scope="session")
def run() -> Callable[..., str]:
    """Return :func:`run_program`."""
    return run_program


@pytest.fixture(scope="session")
def eigen_prefix() -> Path | None:
    """Return the folder that ``pip install cmeel-eigen`` filled; None where only the system has Eigen."""
    try:
        return Path(str(importlib.metadata.distribution("cmeel-eigen").locate_file("cmeel.prefix")))
    except importlib.metadata.PackageNotFoundError:
        return None


@pytest.fixture(scope="session")
def cmake(eigen_prefix: Path | None) -> Callable[..., str]:
    """Return a function that runs cmake with the Eigen and the Ninja of this Python environment."""
    tools = str(Path(sys.executable).parent)
    environment = {"PATH": os.pathsep.join([tools, os.environ["PATH"]]), "CMAKE_GENERATOR": "Ninja"}
    if eigen_prefix:
        environment["CMAKE_PREFIX_PATH"] = str(eigen_prefix)
    program = shutil.which("cmake", path=environment["PATH"])
    if program is None or shutil.which("ninja", path=environment["PATH"]) is None:
        pytest.fail('cmake and ninja are missing: pip install "nacre[test]"', pytrace=False)
    return lambda *arguments, **options: run_program(program, *arguments, **options, **environment)


def build_project(cmake: Callable[..., str], source: Path, name: str, *definitions: str) -> Path:
    """Configure and build a CMake project in ``build/NAME`` and return that folder."""
    folder = ROOT / "build" / name
    strict = "ON" if os.environ.get("CI") else "OFF"  # a stranger's newer compiler may know newer warnings
    # Fresh: the folder may remember the tools of an environment that is gone. What is compiled stays.
    cmake("--fresh", "-S", source, "-B", folder, f"-DNACRE_WARNINGS_AS_ERRORS={strict}", *definitions)
    cmake("--build", folder)
    return folder


@pytest.fixture(scope="session")
def static_build(cmake: Callable[..., str]) -> Path:
    """Build the static library, the C++ tests and the examples."""
    programs = ("-DNACRE_BUILD_TESTS=ON", "-DNACRE_BUILD_EXAMPLES=ON")
    return build_project(cmake, ROOT, "test-static", "-DBUILD_SHARED_LIBS=OFF", *programs)


@pytest.fixture(scope="session")
def shared_build(cmake: Callable[..., str]) -> Path:
    """Build the shared library as part of a stranger's project, which installs it, too."""
    source = ROOT / "tests" / "consumer" / "add_subdirectory"
    definitions = ("-DCMAKE_BUILD_TYPE=Release", "-DBUILD_SHARED_LIBS=ON", "-DNACRE_INSTALL=ON")
    return build_project(cmake, source, "test-shared", *definitions)
