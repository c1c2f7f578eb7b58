"""A stranger's C++ project finds, builds and runs nacre in each of the three ways, static and shared."""

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

CONSUMER = Path(__file__).parents[1] / "consumer"
CPU_FLAGS = Path("/proc/cpuinfo")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session", params=["static", pytest.param("shared", marks=pytest.mark.weekly)])
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def installed(
    kind: str,
    cmake: Callable[..., str],
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """Install the library and then move it: an installed tree works wherever it stands."""
    build = request.getfixturevalue("library_build" if kind == "static" else "shared_build")
    before = tmp_path_factory.mktemp(kind) / "before"
    cmake("--install", build, "--prefix", before, "--component", "development")
    return before.rename(before.parent / "installed")


def build_and_run(
    cmake: Callable[..., str], run: Callable[..., str], name: str, folder: Path, *definitions: str
) -> str:
    cmake("-S", CONSUMER / name, "-B", folder, *definitions)
    cmake("--build", folder)
    return run(folder / "consumer")


def test_find_package(
    kind: str, installed: Path, cmake: Callable[..., str], run: Callable[..., str], tmp_path: Path
) -> None:
    output = build_and_run(cmake, run, "find_package", tmp_path, f"-Dnacre_ROOT={installed}")
    assert "FAILED" not in output
    if (with_openmp := tmp_path / "consumer_openmp").exists():
        output = run(with_openmp)
        assert "FAILED" not in output
        assert kind == "static" or "backend: openmp" in output  # the static one is that of the Python package


@pytest.mark.weekly
def test_add_subdirectory(cmake: Callable[..., str], run: Callable[..., str], tmp_path: Path) -> None:
    assert "FAILED" not in build_and_run(cmake, run, "add_subdirectory", tmp_path)


@pytest.mark.weekly
def test_add_subdirectory_shared(shared_build: Path, run: Callable[..., str]) -> None:
    assert "FAILED" not in run(shared_build / "consumer")


def test_pkg_config(
    kind: str, installed: Path, eigen_prefix: Path | None, run: Callable[..., str], tmp_path: Path
) -> None:
    pkgconf = pytest.importorskip("pkgconf")
    folders = [installed / "lib" / "pkgconfig", installed / "lib64" / "pkgconfig"]
    if eigen_prefix:
        folders.append(eigen_prefix / "share" / "pkgconfig")
    program = tmp_path / "consumer"
    run(
        CONSUMER / "pkg_config" / "build.sh",
        program,
        *(["--static"] if kind == "static" else []),
        PKG_CONFIG=str(pkgconf.get_executable()),
        PKG_CONFIG_PATH=os.pathsep.join(str(folder) for folder in folders),
    )
    assert "FAILED" not in run(program, LD_LIBRARY_PATH=str(installed / "lib"))


@pytest.mark.skipif(
    not CPU_FLAGS.exists() or " avx2 " not in CPU_FLAGS.read_text(), reason="this processor has no AVX2"
)
def test_client_with_other_vector_flags(
    installed: Path, cmake: Callable[..., str], run: Callable[..., str], tmp_path: Path
) -> None:
    definitions = (
        f"-Dnacre_ROOT={installed}",
        "-DCMAKE_CXX_FLAGS=-mavx2 -mfma",
        "-DCMAKE_BUILD_TYPE=Release",
    )
    assert "FAILED" not in build_and_run(cmake, run, "find_package", tmp_path, *definitions)


@pytest.mark.weekly
@pytest.mark.skipif(shutil.which("nm") is None, reason="nm is missing")
def test_shared_library_shows_its_own_names_only(shared_build: Path, run: Callable[..., str]) -> None:
    (library,) = (shared_build / "nacre" / "cpp").glob("libnacre.so.*.*.*")
    symbols = run("nm", "-DC", "--defined-only", library).splitlines()
    names = [line.split(" ", 2)[2] for line in symbols]
    names = [re.sub("^(typeinfo|typeinfo name|vtable) for ", "", name) for name in names]  # of what is thrown
    assert names
    assert [name for name in names if not name.startswith("nacre::")] == []
