"""What is loaded when: a start costs little because modules are imported when they are first needed."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import nacre

LOADED = """
import contextlib, io, sys
before = set(sys.modules)
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    {code}
loaded = set(sys.modules) - before
print(*sorted(name for name in loaded if name.partition(".")[0] not in sys.stdlib_module_names))
"""
HEAVY = {
    "numpy",
    "PIL",
    "matplotlib",
    "open3d",
    "rosbags",
    "scipy",
    "trimesh",
    "websockets",
}


def loaded_by(code: str) -> set[str]:
    """Return the modules, but Python's own, that some code loads in a fresh interpreter."""
    command = [sys.executable, "-c", LOADED.format(code=code)]
    names = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return {name for name in names if not name.startswith(("_nacre", "__editable__"))}


def packages(modules: set[str]) -> set[str]:
    """Return the packages that modules belong to."""
    return {name.partition(".")[0] for name in modules}


def test_import_loads_nothing_else() -> None:
    assert loaded_by("import nacre") == {"nacre"}


def test_the_loop_needs_numpy_alone() -> None:
    code = "import nacre; nacre.Model(nacre.Camera(64, 48, 60, 60, 32, 24)); nacre.read_points"
    modules = loaded_by(code)
    assert packages(modules) == {"nacre", "numpy"}
    assert "nacre.datasets" not in modules


@pytest.mark.parametrize("words", ["['--help']", "['reconstruct', '--help']", "['--version']", "['no-such']"])
def test_the_command_line_starts_without_what_it_does_not_need(words: str) -> None:
    pytest.importorskip("typer")
    modules = loaded_by(f"from nacre.cli import main; main({words})")
    assert packages(modules) & HEAVY == set()
    core = {"nacre._core"} if "version" in words else set()
    below = {name for name in modules if name.startswith("nacre") and not name.startswith("nacre.cli")}
    light = {"nacre._internal", "nacre._internal.signals", "nacre._internal.camera_names"}
    assert below - light == {"nacre", "nacre.errors"} | core


def test_only_the_command_that_is_asked_for_is_built() -> None:
    typer = pytest.importorskip("typer")
    from nacre.cli.app import app, make_app

    whole = typer.main.get_command(app).commands
    one = typer.main.get_command(make_app(only="info")).commands
    assert list(one) == list(whole)
    assert [name for name, command in one.items() if command.params] == ["info"]
    assert [command.help for command in one.values()] == [command.help for command in whole.values()]


def test_every_public_name_is_there() -> None:
    for name in nacre.__all__:
        assert getattr(nacre, name) is not None
    assert set(nacre.__all__) <= set(dir(nacre))
    assert nacre.io.ply.read_ply is not None  # modules too
    with pytest.raises(AttributeError, match="no attribute 'alignn'"):
        _ = nacre.alignn


def test_type_checkers_see_what_python_finds() -> None:
    tree = ast.parse(Path(str(nacre.__file__)).read_text(encoding="utf-8"))
    (checking,) = (node for node in tree.body if isinstance(node, ast.If))
    static = {
        alias.name: str(node.module).removeprefix("nacre.")
        for node in checking.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert static.pop("evaluation") == "nacre"  # a module
    assert static == nacre._MODULES
    assert sorted(nacre.__all__) == sorted([*static, "evaluation"])
