"""The documentation: what it shows runs; where Sphinx and Doxygen are, it builds without a warning."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))


def name_of(page: Path) -> str:
    """Return how a page is called within the documentation."""
    return str(page.relative_to(DOCS).with_suffix(""))


def blocks(page: Path, language: str) -> list[str]:
    """Return the code blocks of a page in a language."""
    return re.findall(
        rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python")], ids=name_of)
def test_the_python_of_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, page.name, "exec"), names)


def calls_of_tables(page: Path) -> list[str]:
    """Return the code of the second column of a page's tables."""
    rows = re.findall(r"^\|[^|]*\|([^|]*)\|", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [code for cell in rows for code in re.findall(r"`([^`]+)`", cell)]


def test_the_calls_beside_those_of_other_libraries_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = DOCS / "coming-from.md"
    names: dict[str, object] = {}
    exec(compile(blocks(page, "python")[0], page.name, "exec"), names)
    calls = calls_of_tables(page)
    assert len(calls) > 50
    for call in calls:
        eval(compile(call, page.name, "eval"), names)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_of_a_page_exist(page: Path) -> None:
    from nacre.cli.app import app

    known = {command.callback.__name__ for command in app.registered_commands if command.callback}
    for block in blocks(page, "sh"):
        assert set(re.findall(r"^nacre (\w+)", block, re.MULTILINE)) <= known


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.stem)
def test_options_of_commands_exist(page: Path) -> None:
    from typer.main import get_command

    from nacre.cli.app import app

    commands = get_command(app).commands  # type: ignore[attr-defined]
    text = page.read_text(encoding="utf-8")
    for line in re.findall(r"^nacre \w.*|`nacre \w[^`]*`", text, re.MULTILINE):
        name, *words = line.strip("`").split()[1:]
        if name not in commands:
            continue  # a sentence that begins with nacre
        known = {option for parameter in commands[name].params for option in parameter.opts}
        known |= {option for parameter in commands[name].params for option in parameter.secondary_opts}
        asked = {word.partition("=")[0] for word in words if re.match(r"-{1,2}[a-z]", word)}
        assert asked <= known | {"--help"}, line


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("doxygen") is None, reason="no Doxygen")
def test_it_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx")
    pytest.importorskip("breathe")
    pytest.importorskip("latex2mathml")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        [ROOT / "docs" / "build", tmp_path],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for page in PAGES:
        assert (tmp_path / page.relative_to(ROOT)).with_suffix(".html").is_file()
    registration = (tmp_path / "docs" / "algorithms" / "registration.html").read_text(encoding="utf-8")
    assert "<math" in registration  # equations need no script
    assert re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="http', registration) == []  # nor the network
    assert "registration.max_iterations" in registration  # parameters come from the code
    cpp = (tmp_path / "docs" / "reference" / "cpp.html").read_text(encoding="utf-8")
    for name in ("add_frame", "to_string", "MeshTree", "NACRE_VERSION", "PointsDouble"):
        assert name in cpp, f"the C++ reference lacks {name}"
