"""The program: its entry, its help, and how it fails."""

import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import fails, run

import nacre

SCRIPT = Path(sys.executable).with_name("nacre")


@pytest.mark.parametrize(
    "program",
    [
        pytest.param(
            [SCRIPT], marks=pytest.mark.skipif(not SCRIPT.exists(), reason="nacre is not installed here")
        ),
        [sys.executable, "-m", "nacre"],
    ],
    ids=["script", "module"],
)
def test_the_entries_work(program):
    done = subprocess.run([*program, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"nacre {nacre.__version__}\n"
    assert done.stderr == ""


def test_help_names_every_command_and_each_has_an_example():
    text = run("--help").out
    for name in ("demo", "reconstruct", "simulate", "evaluate", "align", "consolidate", "info"):
        assert name in text
        result = run(name, "--help")
        assert result.code == 0
        assert f"Example: nacre {name}" in result.out


def test_help_loads_no_heavy_module():
    code = (
        "import sys; from nacre.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: print([m for m in ('PIL', 'nacre.report', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[]\n")


def test_no_arguments_give_help():
    assert run().code == 0
    assert "reconstruct" in run().out


def test_without_typer_one_line_says_what_to_install(tmp_path):
    (tmp_path / "typer.py").write_text("raise ModuleNotFoundError(\"No module named 'typer'\", name='typer')")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from nacre.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code, "demo"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == 'error: the command line needs typer: pip install "nacre[cli]"\n'


@pytest.mark.parametrize(
    "arguments", [["nothing"], ["info", "--nothing", "x"], ["demo", "--views", "0"], ["reconstruct", "x"]]
)
def test_wrong_usage_is_one_line_and_points_to_help(arguments):
    assert "--help)" in fails(2, *arguments)


def test_unexpected_errors_have_a_traceback_only_on_demand(recording, monkeypatch):
    def broken(*arguments, **options):
        raise RuntimeError("broken")

    monkeypatch.setattr(nacre, "open_sequence", broken)
    assert "RuntimeError: broken" in fails(1, "info", recording)
    assert "Traceback" in run("info", recording, "-v", "-v").err


def test_it_leaves_the_log_as_it_was(recording):

    run("info", recording, "-q")
    logger = logging.getLogger("nacre")
    assert (logger.level, logger.propagate) == (logging.NOTSET, True)
    assert [type(handler) for handler in logger.handlers] == [logging.NullHandler]


def test_a_name_that_is_no_text_and_a_terminal_without_letters(recording, tmp_path):
    source, out = (tmp_path / os.fsdecode(name) for name in (b"r\xff", b"o\xff"))
    try:
        shutil.copytree(recording, source)
    except OSError:
        pytest.skip("file names here are text")
    done = subprocess.run(
        [sys.executable, "-c", "from nacre.cli import main; main()", "reconstruct", source, "-o", out],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("r\\udcff: 4 of 4 frames")
    assert "\\xb0 RMS" in done.stdout  # a degree
    assert "<h1>r\\udcff" in (out / "report.html").read_text(encoding="utf-8")


def test_a_recording_has_a_name_that_can_be_written(tmp_path):
    folder = tmp_path / os.fsdecode(b"r\xff")
    try:
        nacre.write_recording(folder, nacre.Camera(4, 3, 4, 4, 1.5, 1), [np.ones((3, 4))], depth_scale=1000)
    except OSError:
        pytest.skip("file names here are text")
    assert nacre.open_sequence(folder).name == "r\\udcff"
    (folder / "camera.json").write_text("{")
    with pytest.raises(nacre.FileFormatError, match=r"r\\udcff/camera.json") as raised:
        nacre.open_sequence(folder)
    assert raised.value.path == folder / "camera.json"
