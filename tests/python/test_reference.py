"""The reference is complete: every public name of Python, every public header of C++, none without a word."""

from __future__ import annotations

import importlib
import inspect
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pytest

import nacre

ROOT = Path(__file__).resolve().parents[2]
HEADERS = sorted((ROOT / "cpp" / "include" / "nacre").glob("*.hpp"))


def documented(kind: str) -> set[str]:
    """Return the names that the Python reference documents by directives of a kind."""
    text = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    return set(re.findall(rf"^\.\. {kind}:: nacre\.([\w.]+)", text, re.MULTILINE))


def test_every_public_name_of_python_is_in_the_reference() -> None:
    missing = set(nacre.__all__) - {"__version__"} - documented(r"auto\w+")
    assert missing == set()


def test_the_reference_names_nothing_that_is_not_there() -> None:
    for name in documented(r"auto\w+"):
        head, _, last = f"nacre.{name}".rpartition(".")
        assert hasattr(importlib.import_module(head), last), name


def test_methods_of_documented_classes_have_docstrings() -> None:
    silent = []
    for name in documented("autoclass"):
        head, _, last = f"nacre.{name}".rpartition(".")
        owner = getattr(importlib.import_module(head), last)
        for member, value in vars(owner).items():
            function = value.fget if isinstance(value, property) else value
            is_code = inspect.isroutine(function) or isinstance(value, property)
            if is_code and not member.startswith("_") and not inspect.getdoc(function):
                silent.append(f"{name}.{member}")
    assert silent == []


def test_functions_describe_their_arguments() -> None:
    """Each argument by name, or the function where they are described."""
    silent = []
    names = documented("autofunction") | {f"evaluation.{name}" for name in nacre.evaluation.__all__}
    for name in sorted(names):
        head, _, last = f"nacre.{name}".rpartition(".")
        function = getattr(importlib.import_module(head), last)
        if not inspect.isfunction(function):
            continue
        text = inspect.getdoc(function) or ""
        for argument in inspect.signature(function).parameters:
            described = re.search(rf"^[\w *,]*\b{argument}\b[\w *,]*( :|$)", text, re.MULTILINE)
            if not described and not re.search(r"(?:those of|see)\s+:func:", text):
                silent.append(f"{name}: {argument}")
    assert silent == []


def test_every_public_header_is_in_the_reference() -> None:
    text = (ROOT / "docs" / "reference" / "cpp.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## .*`nacre/(\w+)\.hpp`$", text, re.MULTILINE)
    assert sorted(headings) == sorted(path.stem for path in HEADERS)
    assert set(re.findall(r"doxygengroup:: (\w+)", text)) == set(headings) - {"version"}


def told(element: ET.Element) -> bool:
    """Whether Doxygen found a comment."""
    parts = (element.find("briefdescription"), element.find("detaileddescription"))
    return any(part is not None and "".join(part.itertext()).strip() for part in parts)


def undocumented(xml: Path) -> Iterator[str]:
    """List types and free functions of the public headers that no comment explains."""
    functions: dict[str, bool] = {}
    for path in sorted(xml.glob("*.xml")):
        for compound in ET.parse(path).getroot().findall("compounddef"):
            name, kind = compound.findtext("compoundname") or "", compound.get("kind")
            if kind in ("class", "struct") and compound.get("prot") == "public" and not told(compound):
                yield name
            for member in compound.iter("memberdef") if kind != "file" else ():
                label, what = f"{name}::{member.findtext('name')}", member.get("kind")
                # A typedef of a reference to an array says all in its name.
                is_clear = told(member) or (what == "typedef" and label.endswith("Ref"))
                if what in ("enum", "typedef") and member.get("prot") == "public" and not is_clear:
                    yield label
                if what == "function" and kind == "group":  # one comment for all overloads
                    functions[label] = functions.get(label, False) or told(member)
    yield from (name for name, is_told in functions.items() if not is_told)


@pytest.mark.skipif(shutil.which("doxygen") is None, reason="no Doxygen")
def test_public_headers_explain_their_types_and_functions(tmp_path: Path) -> None:
    settings = (ROOT / "docs" / "Doxyfile").read_text() + f"\nOUTPUT_DIRECTORY = {tmp_path}\n"
    done = subprocess.run(
        ["doxygen", "-"], input=settings, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert list(undocumented(tmp_path / "xml")) == []
