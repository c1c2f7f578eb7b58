"""Commands run in this process, and what they say."""

import contextlib
import io
import json
from dataclasses import dataclass

import pytest

from nacre.cli import main

pytest.importorskip("typer")

SIMULATION = ("--views", 4, "--step", 12, "--noise", 0.0003, "--orthographic", "--pixel-size", 0.002)


@dataclass(frozen=True)
class Run:
    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


def run(*arguments):
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as stopped,
    ):
        main([str(word) for word in arguments])
    return Run(stopped.value.code, out.getvalue(), err.getvalue())


def strict_json(path):
    return json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} in {path.name}"))


def fails(code, *arguments):
    """Run a command that must fail, and return its one line on stderr."""
    result = run(*arguments)
    assert result.code == code, result
    assert result.err.startswith("error: "), result.err
    assert result.err.count("\n") == 1, result.err
    assert "Traceback" not in result.err
    return result.err
