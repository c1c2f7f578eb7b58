"""What texts point to is there: files, headings, pictures, and the source files that they cite."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("docs", "benchmarks", "examples", "third_party", "tests")
TEXTS = sorted([*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md"))])
TEXTS = [path for path in TEXTS if not {".env", "results", "build"} & set(path.relative_to(ROOT).parts)]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)|^```\{(?:figure|image|include)\} (\S+)", re.MULTILINE)
CITED = re.compile(r"`((?:cpp|python|tests|docs|benchmarks|examples)/[\w./-]+\.(?:[ch]pp|py|md|txt))`")


def prose(path: Path) -> str:
    """Return a text without its code, but with directives, which look like code."""
    lines, fence = [], ""
    for line in path.read_text(encoding="utf-8").splitlines():
        mark = re.match(r"(```+)(.*)", line)
        if mark:
            fence = "" if fence else mark[2].strip() or "text"
        if not fence or fence.startswith("{"):
            lines.append(re.sub(r"`[^`]*\]\([^`]*`", "", line))
    return "\n".join(lines)


def anchors(path: Path) -> set[str]:
    """Return what GitHub and Sphinx call the headings of a text."""
    found: dict[str, int] = {}
    names = set()
    for heading in re.findall(r"^#+ (.+)$", prose(path), re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        name = re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")
        names.add(f"{name}-{found[name]}" if name in found else name)
        found[name] = found.get(name, 0) + 1
    return names


def dead_links(path: Path) -> list[str]:
    """Return the links of a text that lead nowhere; those into the web are not looked at."""
    dead = []
    for link, directive in LINK.findall(prose(path)):
        target = link or directive
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        if not there.exists() or (anchor and there.suffix == ".md" and anchor not in anchors(there)):
            dead.append(target)
    return dead


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path: Path) -> None:
    assert dead_links(path) == []


def test_a_dead_link_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A `b`: c\n[x](#a-b-c) [y](#nothing) [z](gone.md) [w](https://example.org)\n")
    assert dead_links(page) == ["#nothing", "gone.md"]
    page.write_text("```{note}\nx\n```\n[x](gone.md)\n```sh\n[y](code.md)\n```\n[z](lost.md)\n")
    assert dead_links(page) == ["gone.md", "lost.md"]


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_source_files_that_are_cited_exist(path: Path) -> None:
    cited = CITED.findall(path.read_text(encoding="utf-8"))
    assert [name for name in cited if not (ROOT / name).exists()] == []


def test_pictures_are_small_and_shown() -> None:
    shown = "\n".join(path.read_text(encoding="utf-8") for path in TEXTS)
    for picture in sorted((ROOT / "docs" / "images").glob("*.webp")):
        assert picture.stat().st_size < 150_000, picture.name
        assert picture.name in shown, f"no page shows {picture.name}"


def test_pages_are_found_from_the_front_page() -> None:
    """Every page of the site is in a table of contents, so that a reader can get there."""
    listed = set()
    for index in (ROOT / "docs" / "index.md", ROOT / "docs" / "algorithms" / "index.md"):
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", index.read_text(encoding="utf-8"), re.DOTALL):
            for line in tree.splitlines():
                name = re.sub(r".*<(.*)>", r"\1", line.strip())
                if name and not name.startswith(":"):
                    listed.add((index.parent / f"{name}.md").resolve())
    pages = {path for path in (ROOT / "docs").rglob("*.md") if path.name != "index.md"}
    assert pages - listed == set()


def missed_goals() -> list[str]:
    """Return the anchors of what misses a goal, of the tables of tracking and of benchmarks."""
    missed = []
    for line in (ROOT / "docs" / "tracking.md").read_text(encoding="utf-8").splitlines():
        row = re.match(r"\| \[[^\]]*\]\((#[^)]*)\) \|(.*)", line)
        if row and "**" in row[2]:
            missed.append(f"tracking.md{row[1]}")
    for line in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8").splitlines():
        row = re.match(r"\| \[[^\]]*\]\((#[^)]*)\) \|.*\*\*([\d.]+)\*\* \(goal ([\d.]+)\)", line)
        if row and float(row[2]) < float(row[3]):
            missed.append(f"benchmarks.md{row[1]}")
    return missed


def test_limits_name_every_goal_that_is_missed() -> None:
    limits = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    section = limits.partition("## Goals that are missed")[2].partition("And where a peer")[0]
    assert {target for target, _ in LINK.findall(section)} == set(missed_goals())


def test_nothing_generated_is_committed() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    done = subprocess.run(["git", "ls-files", "docs"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert [name for name in done.stdout.split() if "__pycache__" in name or name.endswith(".html")] == []
