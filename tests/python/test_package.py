"""The installed package: what it brings, what it loads, and what it says about itself."""

import importlib.metadata
import io
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import nacre

LOADED = """
import sys
before = set(sys.modules)
import time
start = time.perf_counter()
import nacre
seconds = time.perf_counter() - start
loaded = {name.partition(".")[0] for name in set(sys.modules) - before} - sys.stdlib_module_names
print(seconds)
print(*sorted(loaded))
"""


def test_import_loads_numpy_and_nothing_else() -> None:
    output = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True).stdout
    seconds, loaded = output.splitlines()
    print(f"import nacre: {1e3 * float(seconds):.0f} ms")
    assert {name for name in loaded.split() if not name.startswith("_nacre")} == {"nacre", "numpy"}


def test_version_is_the_headers(root: Path) -> None:
    header = (root / "cpp" / "include" / "nacre" / "version.hpp").read_text()
    (written,) = re.findall(r'#define NACRE_VERSION "([^"]+)"', header)
    assert nacre.__version__ == written
    assert importlib.metadata.version("nacre") == written


def test_numpy_is_the_only_requirement() -> None:
    requirements = importlib.metadata.requires("nacre") or []
    assert [re.match(r"[\w.-]+", r)[0] for r in requirements if "extra ==" not in r] == ["numpy"]  # type: ignore[index]


# They have no wheel for some machines, or are larger than all the rest.
NOT_FOR_ALL = {"realsense", "record3d", "rerun"}


def test_all_brings_every_extra_but_the_developers() -> None:
    metadata = importlib.metadata.metadata("nacre")
    extras = set(metadata.get_all("Provides-Extra") or [])
    (everything,) = (
        r for r in importlib.metadata.requires("nacre") or [] if re.search(r"""extra == ['"]all""", r)
    )
    assert set(re.findall(r"\[(.*?)\]", everything)[0].split(",")) == extras - {"all", "test"} - NOT_FOR_ALL


def test_metadata_is_complete() -> None:
    metadata = importlib.metadata.metadata("nacre")
    for field in (
        "Summary",
        "Author",
        "License-Expression",
        "Requires-Python",
        "Description",
        "Keywords",
        "Classifier",
    ):
        assert metadata[field], field


def test_wheel_is_small_and_holds_python_alone() -> None:
    files = [f for f in importlib.metadata.files("nacre") or [] if "__pycache__" not in f.parts]
    if any("editable" in f.name for f in files):
        pytest.skip("an editable installation has no wheel")
    assert {f.parts[0] for f in files} <= {"nacre", f"nacre-{nacre.__version__}.dist-info", ".."}
    assert not [f for f in files if f.suffix in {".hpp", ".cpp", ".a", ".cmake", ".pc"}]
    assert [f for f in files if f.name == "py.typed"]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as wheel:
        for file in files:
            wheel.write(str(file.locate()), str(file))
    print(f"wheel: {buffer.tell() / 1e6:.2f} MB")
    assert buffer.tell() < 3e6


def test_source_distribution_can_be_built_from(root: Path, tmp_path: Path) -> None:
    pytest.importorskip("scikit_build_core", reason="scikit-build-core is missing: pip install --group build")
    import tarfile

    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=root, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    wanted = [
        *root.glob("cpp/**/*.*pp"),
        *root.glob("cpp/*"),
        *root.glob("python/**/*.py"),
        *root.glob("python/**/*.?pp"),
    ]
    wanted += [*root.glob("tests/**/*.*py"), *root.glob("tests/**/*.cpp"), *root.glob("third_party/**/*")]
    wanted += [
        root / name for name in ("CMakeLists.txt", "LICENSE", "README.md", "pyproject.toml", "PKG-INFO")
    ]
    files = {
        path.relative_to(root).as_posix() for path in wanted if path.is_file() or path.name == "PKG-INFO"
    }
    assert files - names == set()
    assert not [name for name in names if name.startswith("build/") or name.endswith((".so", ".pyc"))]
