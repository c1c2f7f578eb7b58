"""The installed package: what it brings, what it loads, and what it says about itself."""

import importlib.metadata
import re
import subprocess
import sys
from pathlib import Path

import pytest

import nacre


def test_version_is_the_headers(root: Path) -> None:
    header = (root / "cpp" / "include" / "nacre" / "version.hpp").read_text()
    (written,) = re.findall(r'#define NACRE_VERSION "([^"]+)"', header)
    assert nacre.__version__ == written
    assert importlib.metadata.version("nacre") == written
    for name in ("CITATION.cff", "recipe/recipe.yaml"):
        text = (root / name).read_text(encoding="utf-8")
        assert re.findall(r'^ *version: "?([\d.]+)"?$', text, re.MULTILINE) == [written], name


def test_numpy_is_the_only_requirement() -> None:
    requirements = importlib.metadata.requires("nacre") or []
    assert [re.match(r"[\w.-]+", r)[0] for r in requirements if "extra ==" not in r] == ["numpy"]  # type: ignore[index]


# They have no wheel for some machines, or are larger than all the rest.
NOT_FOR_ALL = {"realsense", "record3d", "rerun"}


def test_all_brings_every_extra_but_the_developers() -> None:
    metadata = importlib.metadata.metadata("nacre")
    extras = set(metadata.get_all("Provides-Extra") or [])
    everything = {
        name
        for requirement in importlib.metadata.requires("nacre") or []
        if re.search(r"""extra == ['"]all""", requirement)
        for name in re.findall(r"\[(.*?)\]", requirement)[0].split(",")
    }
    assert everything == extras - {"all", "test"} - NOT_FOR_ALL


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


def test_source_distribution_holds_what_it_must_and_nothing_else(root: Path, tmp_path: Path) -> None:
    pytest.importorskip("scikit_build_core", reason="scikit-build-core is missing: pip install --group build")
    import tarfile

    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=root, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    about_the_repository = ("benchmarks", "codebase", "docs", "tracking_table")
    unwanted = {f"tests/python/test_{name}.py" for name in about_the_repository}
    folders = ("cpp", "python", "tests", "examples", "third_party")
    paths = (path for folder in folders for path in (root / folder).rglob("*"))
    made = {"__pycache__", ".hypothesis"}
    wanted = {
        path.relative_to(root).as_posix()
        for path in paths
        if path.is_file() and made.isdisjoint(path.parts) and path.suffix not in {".so", ".pyc"}
    }
    wanted |= {"CITATION.cff", "CHANGELOG.md", "CMakeLists.txt", "CMakePresets.json", "LICENSE", "PKG-INFO"}
    wanted |= {"README.md", "SECURITY.md", "pyproject.toml"}
    assert names == wanted - unwanted
