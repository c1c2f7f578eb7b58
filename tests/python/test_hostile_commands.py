"""A bad file anywhere in a command: exit code 1, one line that names it, and no traceback."""

import contextlib
import importlib.util
import io
import re

import pytest

pytest.importorskip("typer")
from hostile_files import CASES, write
from hostile_files.meshes import TRIANGLE
from hostile_files.ply import text, vertices
from hostile_files.recordings import plain
from hostile_files.trajectories import GOOD

from nacre.cli.app import run

GOOD_FILES = {
    "points.ply": text("0 0 0\n1 0 0\n0 1 0\n", vertices(3)),
    "mesh.obj": (TRIANGLE + "f 1 2 3\n").encode(),
    "truth.txt": GOOD.encode(),
    **{f"recording/{name}": data for name, data in plain().items()},
}
COMMANDS = {
    "points": (
        "info {bad}",
        "consolidate {bad} {out}.ply",
        "align {bad} {good}/points.ply",
        "mesh {bad} -o {out}.ply",
        "convert {bad} {out}.pcd",
    ),
    "range grid": ("reconstruct {bad} -o {out}",),
    "mesh": (
        "info {bad}",
        "simulate {bad} -o {out}",
        "evaluate {good}/points.ply {bad}",
        "convert {bad} {out}.stl",
    ),
    "camera": (
        "info {good}/recording --camera {bad}",
        "reconstruct {good}/recording --camera {bad} -o {out}",
    ),
    "trajectory": (
        "evaluate {bad} {good}/truth.txt",
        "evaluate {good}/truth.txt {bad}",
        "convert {bad} {out}.log",
    ),
    "matrix": ("evaluate {good}/points.ply {good}/mesh.obj --world-from-model {bad}",),
    "config": ("reconstruct {good}/recording --config {bad} -o {out}",),
    "recording": ("reconstruct {bad} -o {out}",),
    "run": ("info {bad}", "reconstruct --resume {bad}"),
    "output": ("view {bad} --html {out}.html", "evaluate {bad} {good}/mesh.obj"),
}
# Told as wrong usage: the folder or file is not what the command takes.
USAGE = "known recording|the folder is empty|not a recording"
# The frame that cannot be read is left out and told; the others are used.
# What is wrong is not what the command looks at: points without triangles, a model without normals.
ALSO_GOOD = r"mesh/ply_without_faces|output/model_without"
LEFT_OUT = r"recording/(tum_image|plain_(mask|attribute|bomb)|tum_list_of_a_folder)"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    for name, data in GOOD_FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    return folder


def said(*words):
    """Run a command; return its exit code and what it said on stderr."""
    err = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(err):
        code = run(words)
    return code, err.getvalue()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", COMMANDS)
def test_bad_file_ends_a_command(good, tmp_path, kind):
    wrong = []
    for num, (name, case) in enumerate(CASES.items()):
        if case.reader != kind or importlib.util.find_spec(case.needs) is None:
            continue
        bad = write(case, tmp_path)
        # What is said of a journal, is said only where the recording of its run is there.
        several = "/run_" in name if kind == "run" else num % 10 == 0
        for command in COMMANDS[kind][: 5 if several else 1]:
            words = command.format(bad=bad, good=good, out=tmp_path / "out").split()
            code, err = said(*words)
            lines = [line for line in err.splitlines() if not line.startswith("warning: ")]
            expected = {2} if re.search(USAGE, err) else {1}
            if re.match(f"{LEFT_OUT}|{ALSO_GOOD}", name):
                expected = {0, 1, 3}
            is_told = code == 0 or (lines and lines[0].startswith("error: ") and str(tmp_path) in lines[0])
            if code not in expected or not is_told or "Traceback" in err or "should not happen" in err:
                wrong.append(f"{name}: nacre {words[0]} gave {code}: {err[:300]}")
    assert not wrong, "\n" + "\n".join(wrong)
