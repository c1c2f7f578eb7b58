"""``nacre doctor``, and the shell's completion of commands."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
import sys

import pytest

import nacre
from nacre.cli import doctor as module
from nacre.cli import main

PROGRAM = [sys.executable, "-c", "from nacre.cli import main; main()"]


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert not end.value.code
    return capsys.readouterr().out


def test_it_tells_versions_and_that_the_library_works(capsys: pytest.CaptureFixture[str]) -> None:
    figures = json.loads(run(capsys, "doctor", "--json"))
    assert figures["nacre"] == nacre.__version__
    assert figures["instruction_set"] == nacre.instruction_set()
    assert figures["parallel_backend"] == nacre.parallel_backend()
    assert figures["self_test"] == "passed"
    assert "self test" in run(capsys, "doctor")


def test_a_wrong_library_fails_the_self_test(monkeypatch: pytest.MonkeyPatch) -> None:
    real = nacre.align

    def wrong(source, target):  # type: ignore[no-untyped-def]
        return real(source, target + 0.01)

    monkeypatch.setattr(nacre, "align", wrong)
    assert module.self_test().startswith("FAILED: align is off by")


def test_a_missing_extra_comes_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    requirements = ['typer>=0.15; extra == "cli"', 'no-such-thing>=1; extra == "view"', "numpy>=1.22"]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: requirements)
    found = module.extras()
    assert found["view"] == {"no-such-thing": None}
    assert found["cli"]["typer"]
    assert module.told("view", found["view"]) == 'no-such-thing missing: pip install "nacre[view]"'
    assert module.told("cli", found["cli"]).startswith("typer ")


def test_an_uninstalled_copy_has_no_extras(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", missing)
    assert module.extras() == {}


def test_the_shell_completes_commands() -> None:
    environment = {
        **os.environ,
        "_NACRE_COMPLETE": "complete_bash",
        "COMP_WORDS": "nacre rec",
        "COMP_CWORD": "1",
    }
    done = subprocess.run(PROGRAM, env=environment, capture_output=True, text=True, check=False)
    assert "reconstruct" in done.stdout.split()
