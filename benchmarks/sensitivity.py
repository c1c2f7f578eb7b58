#!/usr/bin/env python
"""
Change every tuned number of the C++ sources at random, build that, and run the pieces of real recordings.

What is tuned should hardly matter: cameras differ by more than numbers are known to. Each seed multiplies
each number that a `limits.hpp` calls tuned by FACTOR or divides it, as a coin decides; of a part of something
above a half, what is missing to one.

    python benchmarks/sensitivity.py WORK --seeds 0 1 2 3 --factor 1.25
    python benchmarks/sensitivity.py WORK --seeds 0 --numbers depth tracking.narrow_gate

WORK holds the sources that are changed and what is built of them. It needs a compiler, CMake, pybind11,
scikit-build-core and pip in the environment that it runs in, besides what pieces.py needs.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ["CMakeLists.txt", "pyproject.toml", "README.md", "LICENSE", "cpp", "python", "third_party"]
NOT_ASKED = {"simulation", "mesh", "deformation", "consolidation"}
"""Folders of which no piece of a recording knows."""
TUNED = re.compile(r"(.*constexpr ([\w:]+) (\w+) = )([\d.e-]+)(F?;  // \[.+?\] tuned: .+)")


def changed(kind: str, value: str, factor: float) -> str:
    """Return a number of a type, as it is written, times a factor."""
    number = float(value)
    if kind not in ("double", "float"):
        return str(max(1, round(number * factor)))
    if 0.5 < number < 1.0:
        return repr(1.0 - (1.0 - number) * factor)
    return repr(number * factor)


def write_changed(work: Path, seed: int | None, factor: float, numbers: list[str]) -> dict[str, str]:
    """Write the headers anew, with the numbers that are named (or all) changed; return what they are now."""
    now = {}
    for header in sorted((ROOT / "cpp" / "src").glob("*/limits.hpp")):
        lines = header.read_text(encoding="utf-8").splitlines(keepends=True)
        for i, line in enumerate(lines):
            match = TUNED.match(line)
            folder = header.parent.name
            if seed is None or not match or folder in NOT_ASKED:
                continue
            name = f"{folder}.{match[3]}"
            if numbers and folder not in numbers and name not in numbers:
                continue
            # A generator of its own: a number has the same factor whatever others are asked.
            value = changed(match[2], match[4], factor ** random.Random(f"{seed} {name}").choice((-1, 1)))
            now[name] = f"{match[4]} -> {value}"
            lines[i] = f"{match[1]}{value}{match[5]}\n"
        target = work / "source" / header.relative_to(ROOT)
        text = "".join(lines)
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")
    return now


def copy_sources(work: Path) -> None:
    """Copy what is built; numbers are written apart, so that what does not change is not built again."""
    for name in SOURCES:
        target = work / "source" / name
        if (ROOT / name).is_dir():
            ignored = shutil.ignore_patterns("limits.hpp", "__pycache__", "*.so")
            shutil.copytree(ROOT / name, target, ignore=ignored, dirs_exist_ok=True)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)


def build(work: Path) -> Path:
    """Build and install what is in WORK; return the folder to import from."""
    target = work / "installed"
    shutil.rmtree(target, ignore_errors=True)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    pip += ["--target", str(target), f"-Cbuild-dir={work / 'build'}", str(work / "source")]
    subprocess.run(pip, check=True)
    return target


def run(installed: Path, names: list[str], output: Path) -> dict[str, int]:
    """Run the pieces with what was built; return the sums over all."""
    command = [sys.executable, str(ROOT / "benchmarks" / "pieces.py"), *names, "--output", str(output)]
    environment = os.environ | {"PYTHONPATH": str(installed)}
    where = [sys.executable, "-c", "import nacre; print(nacre.__file__)"]
    imported = subprocess.check_output(where, env=environment, text=True).strip()
    if installed not in Path(imported).parents:
        raise SystemExit(f"Python imports {imported}, not what was built; uninstall the editable nacre")
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    pieces = json.loads(output.read_text(encoding="utf-8"))
    return {key: sum(piece[key] for piece in pieces) for key in ("right", "claimed", "far_off", "frames")}


def main() -> None:
    """Build and run each seed that is asked, after the numbers as they are."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work", type=Path, metavar="WORK")
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2, 3])
    parser.add_argument("--factor", type=float, default=1.25)
    parser.add_argument(
        "--numbers", nargs="*", default=[], help="those alone that are changed, or their folders; all"
    )
    parser.add_argument("--names", nargs="*", default=[], help="recordings whose pieces run; all")
    parser.add_argument("--as-they-are", action="store_true", help="run the numbers as they are, too")
    arguments = parser.parse_args()
    work = arguments.work.resolve()
    copy_sources(work)
    for seed in ([None] if arguments.as_they_are else []) + arguments.seeds:
        now = write_changed(work, seed, arguments.factor, arguments.numbers)
        output = work / f"pieces-{'as-they-are' if seed is None else seed}.json"
        sums = run(build(work), arguments.names, output)
        output.with_suffix(".numbers.json").write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
        print(seed, *(f"{key} {value}" for key, value in sums.items()), flush=True)


if __name__ == "__main__":
    main()
