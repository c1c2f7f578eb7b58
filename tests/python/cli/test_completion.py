"""The shell's completion, in the shells themselves where they are installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("typer")

# What is typed, and what is offered.
TYPED = {
    "nacre rec": {"reconstruct"},
    "nacre reconstruct --pre": {"--preset"},
    "nacre reconstruct x --preset ": {"default", "paper"},
    "nacre reconstruct x --format ic": {"icl-nuim"},
    "nacre convert x y --to n": {"nerfstudio"},
    "nacre reconstruct x --set fusion.max": {"fusion.max_confidence=", "fusion.max_free_space_violations="},
}  # fmt: skip

# Prints what the shell offers after the words in $1, as its user would get it with the tab key.
SHELLS = {
    "bash": 'eval "$SCRIPT"; COMP_LINE=$1; read -ra COMP_WORDS <<< "$1"; '
    '[[ $1 == *" " ]] && COMP_WORDS+=(""); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); '
    '_nacre_completion nacre; printf "%s\\n" "${COMPREPLY[@]}"',
    "fish": "echo $SCRIPT | source; complete --do-complete $argv[1]",
    "zsh": 'compdef() { :; }; _arguments() { print -r -- "$@"; }; '
    'eval "$SCRIPT"; words=(${(z)1}); [[ $1 == *" " ]] && words+=(""); CURRENT=${#words}; '
    "_nacre_completion",
}  # fmt: skip


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment with this Python's ``nacre`` as a command."""
    folder = tmp_path_factory.mktemp("bin")
    (folder / "nacre").write_text(f"#!{sys.executable}\nfrom nacre.cli import main\nmain()\n")
    (folder / "nacre").chmod(0o755)
    path = os.pathsep.join(entry for entry in sys.path if entry)
    return {
        **os.environ,
        "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": path,
        "HOME": str(folder),
    }


def run(*words: str, cwd: Path | None = None, **environment: str) -> str:
    return subprocess.run(words, env=environment, cwd=cwd, capture_output=True, text=True, check=False).stdout


def offered(shell: str, script: str, typed: str, folder: Path, environment: dict[str, str]) -> str:
    name = [] if shell == "fish" else [shell]
    return run(shell, "-c", SHELLS[shell], *name, typed, cwd=folder, **environment, SCRIPT=script)


@pytest.mark.parametrize("shell", SHELLS)
def test_the_shell_offers_commands_options_and_values(
    shell: str, environment: dict[str, str], tmp_path: Path
) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    script = run("nacre", **environment, _NACRE_COMPLETE=f"source_{shell}")
    for typed, expected in TYPED.items():
        text = offered(shell, script, typed, tmp_path, environment)
        for word in expected:
            assert word in text, (typed, text)
        assert "demo" not in text
    if shell == "fish":  # others leave files to their own
        (tmp_path / "recording").mkdir()
        assert "recording/" in offered(shell, script, "nacre reconstruct reco", tmp_path, environment)
