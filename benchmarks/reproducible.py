"""
Two wheels of the same sources, built in different folders, one after the other, are the same file.

    python benchmarks/reproducible.py      # some minutes: everything is compiled twice, without a cache

Needs the dependency group "build". Takes what git tracks; prints the SHA-256 of both.
Ends with 1 where they differ.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def build(folder: Path) -> Path:
    """Build a wheel from a copy of the sources in ``folder``."""
    sources = folder / "sources"
    sources.mkdir(parents=True)
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True)
    subprocess.run(["tar", "-x", "-C", str(sources)], input=archive.stdout, check=True)
    # `pip install --no-build-isolation` finds cmake and ninja beside this Python.
    tools = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000", "CCACHE_DISABLE": "1", "PATH": tools}
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "--wheel-dir", str(folder), str(sources)], env=environment, check=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def differing(first: Path, second: Path) -> list[str]:
    """Name the files in two wheels that are not the same."""
    with zipfile.ZipFile(first) as one, zipfile.ZipFile(second) as two:
        names = set(one.namelist()) | set(two.namelist())
        both = set(one.namelist()) & set(two.namelist())
        return sorted(name for name in names if name not in both or one.read(name) != two.read(name))


def main() -> int:
    """Build both, and compare."""
    with tempfile.TemporaryDirectory() as folder:
        wheels = [build(Path(folder) / "one"), build(Path(folder) / "another one" / "deeper")]
        hashes = [hashlib.sha256(wheel.read_bytes()).hexdigest() for wheel in wheels]
        for wheel, digest in zip(wheels, hashes, strict=True):
            print(f"{digest}  {wheel.name}, {wheel.stat().st_size / 1e6:.2f} MB")
        if hashes[0] == hashes[1]:
            return 0
        print("they differ in", ", ".join(differing(*wheels)) or "the archive alone")
        return 1


if __name__ == "__main__":
    sys.exit(main())
