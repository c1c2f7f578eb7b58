"""
Write nacre/_core.pyi from the extension module that is installed.

    pip install pybind11-stubgen && python python/make_stub.py
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

# What pybind11 cannot say of its signatures.
REPLACEMENTS = (
    ("-> tuple:", "-> tuple[typing.Any, ...]:"),
    ("arg0: tuple)", "arg0: tuple[typing.Any, ...])"),
    ("-> dict:", "-> dict[str, typing.Any]:"),
    ("collections.abc.Callable |", "collections.abc.Callable[..., typing.Any] |"),
    ("def __eq__(self, arg0: Camera)", "def __eq__(self, arg0: object)"),
)


def main() -> None:
    """Generate, correct and format the stub."""
    target = Path(__file__).parent / "nacre" / "_core.pyi"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pybind11_stubgen", "nacre._core", "-o", folder]
        subprocess.run(command, check=True)
        text = (Path(folder) / "nacre" / "_core.pyi").read_text()
    for written, meant in REPLACEMENTS:
        text = text.replace(written, meant)
    # Enumerations: members as the typing specification writes them, and no constructor.
    for name in re.findall(r"class (\w+)\(enum\.Enum\)", text):
        text = re.sub(rf"    (\w+): typing\.ClassVar\[{name}\]", r"    \1 = ...", text)
    text = re.sub(r"    @classmethod\n    def __new__\(cls, value\):\n( {8}.*\n)*", "", text)
    target.write_text("".join(line for line in text.splitlines(True) if not line.startswith("__all__")))
    subprocess.run(["ruff", "format", "--quiet", str(target)], check=True)
    subprocess.run(["ruff", "check", "--fix", "--quiet", str(target)], check=True)


if __name__ == "__main__":
    main()
