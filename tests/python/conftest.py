"""What all tests share: where things are, and the C++ library, built once for the session."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import hypothesis
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(Path(__file__).parent))  # for what tests share

if sys.platform != "win32":
    import fcntl

RECORDINGS = ROOT.parent / "shared" / "data"

hypothesis.settings.register_profile("nacre", derandomize=True, deadline=None, database=None)
hypothesis.settings.load_profile("nacre")


def pytest_report_header() -> str:
    """Say what is tested, and on top of what."""
    return f"nacre {importlib.metadata.version('nacre')}, numpy {np.__version__}"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests that need recordings where there are none, and those of the weekly run elsewhere."""
    for item in items:
        if not RECORDINGS.is_dir() and item.get_closest_marker("data"):
            item.add_marker(pytest.mark.skip(reason="no recordings in ../shared/data"))
        if "NACRE_TEST_ALL" not in os.environ and item.get_closest_marker("weekly"):
            item.add_marker(pytest.mark.skip(reason="part of .ci/slow: NACRE_TEST_ALL=1 runs it"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Let what a test logs go from process to process: names of files need not be text."""
    report = yield
    report.sections = [
        (name, text.encode("utf-8", "backslashreplace").decode()) for name, text in report.sections
    ]
    return report


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


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other processes of the tests from a build folder meanwhile."""
    folder.parent.mkdir(exist_ok=True)
    with folder.with_suffix(".lock").open("w") as lock:
        if sys.platform != "win32":
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def build_project(cmake: Callable[..., str], source: Path, name: str, *definitions: str) -> Path:
    """Configure and build a CMake project in ``build/NAME`` and return that folder."""
    folder = ROOT / "build" / name
    strict = "ON" if os.environ.get("CI") else "OFF"  # a stranger's newer compiler may know newer warnings
    with alone_in(folder):
        # Fresh: the folder may remember the tools of an environment that is gone. What is compiled stays.
        cmake("--fresh", "-S", source, "-B", folder, f"-DNACRE_WARNINGS_AS_ERRORS={strict}", *definitions)
        cmake("--build", folder)
    return folder


def is_newer_than_its_sources(library: Path) -> bool:
    """Whether nothing that a library is made of has changed since."""
    sources = [path for path in (ROOT / "cpp").rglob("*") if path.is_file()]
    return library.stat().st_mtime > max(path.stat().st_mtime for path in sources)


@pytest.fixture(scope="session")
def library_build(cmake: Callable[..., str]) -> Path:
    """Return the build folder of the static library: of the installation itself, where it is left."""
    for library in sorted((ROOT / "build").glob("cp*/cpp/libnacre.a")):
        if is_newer_than_its_sources(library):
            return library.parents[1]
    return build_project(cmake, ROOT, "test-library", "-DBUILD_SHARED_LIBS=OFF", "-DNACRE_INSTALL=ON")


@pytest.fixture(scope="session")
def installed_library(cmake: Callable[..., str], library_build: Path) -> Path:
    """Install the static library, its headers and package files."""
    folder = ROOT / "build" / "test-installed"
    with alone_in(folder):
        cmake("--install", library_build, "--prefix", folder, "--component", "development")
    return folder


@pytest.fixture(scope="session")
def cpp_tests(cmake: Callable[..., str], installed_library: Path) -> Path:
    """Build the C++ tests on the installed library."""
    return build_project(cmake, ROOT / "tests" / "cpp", "test-cpp", f"-Dnacre_ROOT={installed_library}")


@pytest.fixture(scope="session")
def cpp_examples(cmake: Callable[..., str], installed_library: Path) -> Path:
    """Build the C++ examples on the installed library."""
    definitions = (f"-Dnacre_ROOT={installed_library}", "-DCMAKE_BUILD_TYPE=Release")
    return build_project(cmake, ROOT / "examples" / "cpp", "test-examples", *definitions)


@pytest.fixture(scope="session")
def shared_build(cmake: Callable[..., str]) -> Path:
    """Build the shared library as part of a stranger's project, which installs it, too."""
    source = ROOT / "tests" / "consumer" / "add_subdirectory"
    definitions = ("-DCMAKE_BUILD_TYPE=Release", "-DBUILD_SHARED_LIBS=ON", "-DNACRE_INSTALL=ON")
    return build_project(cmake, source, "test-shared", *definitions)
