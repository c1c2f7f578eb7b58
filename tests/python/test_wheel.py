"""The installed wheel: its size, what is in it, its licences and its bill of materials."""

import importlib.metadata
import json
import zipfile
from importlib.metadata import PackagePath
from io import BytesIO

import pytest

import nacre


@pytest.fixture(scope="module")
def files() -> list[PackagePath]:
    """Return what the wheel installed."""
    found = [f for f in importlib.metadata.files("nacre") or [] if "__pycache__" not in f.parts]
    if any("editable" in f.name for f in found) or not any(f.name.startswith("_core.") for f in found):
        pytest.skip("there is no wheel: an editable installation, or none")
    return found


def text_of(files: list[PackagePath], end: str) -> str:
    (file,) = (f for f in files if f.as_posix().endswith(end))
    return file.read_text(encoding="utf-8")


def test_it_holds_the_package_and_nothing_else(files: list[PackagePath]) -> None:
    assert {f.parts[0] for f in files} <= {"nacre", f"nacre-{nacre.__version__}.dist-info", ".."}
    assert {f.name for f in files if f.parts[0] == ".."} <= {"nacre", "nacre.exe"}  # the command
    binaries = (".so", ".pyd", ".dylib", ".dll")
    suffixes = {"." + f.name.rpartition(".")[2] for f in files if f.parts[0] == "nacre"}
    assert suffixes - {*binaries} == {".py", ".pyi", ".typed", ".css", ".html", ".js", ".svg"}
    assert (
        len([f for f in files if f.name.endswith(binaries)]) == 1
    )  # no library of threads or of C++ is bundled


def test_it_is_small(files: list[PackagePath]) -> None:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as wheel:
        for file in files:
            wheel.write(str(file.locate()), str(file))
    print(f"wheel: {buffer.tell() / 1e6:.2f} MB")
    assert buffer.tell() < 3e6


def test_it_carries_the_licences_of_all_that_is_compiled_in(files: list[PackagePath]) -> None:
    assert "MIT License" in text_of(files, "licenses/LICENSE")
    assert "Mozilla Public License Version 2.0" in text_of(files, "licenses/third_party/licenses/eigen.txt")
    assert "Wenzel Jakob" in text_of(files, "licenses/third_party/licenses/pybind11.txt")


def test_its_bill_of_materials_says_what_is_compiled_in(files: list[PackagePath]) -> None:
    materials = json.loads(text_of(files, "sboms/nacre.cdx.json"))
    assert (materials["bomFormat"], materials["specVersion"]) == ("CycloneDX", "1.6")
    assert materials["metadata"]["component"]["version"] == nacre.__version__
    components = {c["name"]: c for c in materials["components"]}
    assert {name: c["licenses"][0]["license"]["id"] for name, c in components.items()} == {
        "eigen": "MPL-2.0",
        "pybind11": "BSD-3-Clause",
    }
    assert all(c["version"][:1].isdigit() for c in components.values())


def test_its_bill_of_materials_keeps_to_the_schema(files: list[PackagePath]) -> None:
    reason = "cyclonedx-python-lib is missing: pip install --group dev"
    validation = pytest.importorskip("cyclonedx.validation.json", reason=reason)
    version = pytest.importorskip("cyclonedx.schema", reason=reason).SchemaVersion.V1_6
    error = validation.JsonStrictValidator(version).validate_str(text_of(files, "sboms/nacre.cdx.json"))
    assert error is None, error
