"""What nacre is made of, what may reach it, and what it reaches: code, network, licences, actions."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import nacre

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(str(nacre.__file__)).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))

# Whatever runs code, other programs, or opens connections.
FORBIDDEN_MODULES = {
    "code", "ctypes", "dill", "ftplib", "http", "httpx", "imp", "joblib", "marshal", "pickle", "pty",
    "requests", "runpy", "shelve", "smtplib", "socket", "subprocess", "telnetlib", "urllib", "webbrowser",
    "xmlrpc", "yaml",
}  # fmt: skip
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
FORBIDDEN_METHODS = {"system", "popen", "execv", "execve", "execvp", "spawnl", "spawnv", "fromregex"}
# The viewer answers the user's own browser, and takes its questions apart.
ALLOWED = {"webbrowser": {"viewer", "cli"}, "http": {"viewer"}, "urllib": {"viewer"}}


def dangers(source: str, folder: str = "") -> Iterator[str]:
    """Name what of a program could run code that came with a file, or reach the network."""
    for node in ast.walk(ast.parse(source)):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        for name in (name.partition(".")[0] for name in names):
            if name in FORBIDDEN_MODULES and folder not in ALLOWED.get(name, set()):
                yield f"line {node.lineno}: import {name}"
        if not isinstance(node, ast.Call):
            continue
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        if called in FORBIDDEN_CALLS or method in FORBIDDEN_METHODS:
            yield f"line {node.lineno}: {called or method}(...)"
        for keyword in node.keywords:
            is_true = not (isinstance(keyword.value, ast.Constant) and not keyword.value.value)
            if keyword.arg in ("shell", "allow_pickle") and is_true:
                yield f"line {node.lineno}: {keyword.arg}=..."
        if method == "load" and isinstance(node.func, ast.Attribute):
            of = node.func.value
            if isinstance(of, ast.Name) and of.id in ("np", "numpy", "torch", "yaml"):
                keywords = {keyword.arg for keyword in node.keywords}
                if "allow_pickle" not in keywords:
                    yield f"line {node.lineno}: {of.id}.load without allow_pickle=False"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_no_file_can_make_the_package_run_code(path: Path) -> None:
    folder = path.relative_to(PACKAGE).parts[0]
    assert list(dangers(path.read_text(encoding="utf-8"), folder)) == []


@pytest.mark.parametrize(
    "code",
    [
        "import pickle", "from pickle import loads", "import urllib.request", "eval(text)", "exec(text)",
        "subprocess.run(x, shell=True)", "os.system(x)", "np.load(f)", "np.load(f, allow_pickle=True)",
        "yaml.load(f)", "import socket as s", "__import__(name)",
    ],
)  # fmt: skip
def test_dangers_are_seen(code: str) -> None:
    assert len(list(dangers(code))) == 1


OFFLINE = """
import pathlib, sys, tempfile
used = []
def hook(event, arguments):
    if event.split(".")[0] in ("socket", "urllib", "http", "ftplib", "subprocess") or event == "os.system":
        used.append((event, str(arguments)[:80]))
        raise PermissionError(event)
sys.addaudithook(hook)
if sys.argv[1:] == ["break"]:
    import socket
    socket.socket()
import nacre
for name in nacre.__all__:
    getattr(nacre, name)
import nacre.datasets, nacre.evaluation, nacre.report
folder = pathlib.Path(tempfile.mkdtemp())
thing = nacre.built_in_object()
camera = nacre.Camera(96, 72, 79, 79, 47.5, 35.5)
poses = nacre.turntable_poses(thing, 3, 0.1, camera=camera)
depths = [thing.simulate_depth(camera, pose, noise=0.0005) for pose in poses]
try:
    import PIL
except ImportError:
    frames = [nacre.datasets.SequenceFrame(i, d, camera, None, None, None) for i, d in enumerate(depths)]
    done = nacre.reconstruct(frames)
else:
    nacre.write_recording(folder / "recording", camera, depths, depth_scale=5000)
    done = nacre.reconstruct(folder / "recording")
nacre.write_points(folder / "model.ply", done.model.points)
if "PIL" in sys.modules:
    nacre.report.write_report(folder / "report.html", done.report_data("title", "source"))
assert len(nacre.read_points(folder / "model.ply").points) == len(done.model)
print("done", used)
"""


def run_offline(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", OFFLINE, *words], capture_output=True, text=True, check=False
    )


def test_nothing_reaches_for_the_network_or_another_program() -> None:
    """Import, recording, model, points and report, with sockets and processes forbidden."""
    done = run_offline()
    assert done.stdout.strip() == "done []", done.stderr


def test_a_socket_would_be_seen() -> None:
    assert "PermissionError: socket" in run_offline("break").stderr


def test_import_is_fast() -> None:
    """The best of five, since other programs run too: processor time, less that of an empty interpreter."""
    clock = "import time; t = time.process_time(); {}; print(time.process_time() - t)"

    def best(code: str) -> float:
        command = [sys.executable, "-c", clock.format(code)]
        return min(float(subprocess.check_output(command, text=True)) for _ in range(5))

    core = best("import nacre; nacre.Model")
    print(f"import nacre: {1000 * best('import nacre'):.0f} ms, with Model and NumPy {1000 * core:.0f} ms")
    assert best("import nacre") < 0.15
    assert core < best("import numpy") + 0.15


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="no /proc/net/tcp on this system")
def test_the_viewer_listens_on_loopback_alone() -> None:
    from nacre.viewer import Timeline, Viewer

    def listening(file: str) -> set[tuple[str, int]]:
        rows = [line.split() for line in Path(file).read_text().splitlines()[1:]]
        ends = [row[1].split(":") for row in rows if row[3] == "0A"]
        return {(address, int(port, 16)) for address, port in ends}

    viewer = Viewer(Timeline("title", None), port=8123)
    try:
        port = int(viewer.url.rpartition(":")[2])
        assert viewer.url == f"http://127.0.0.1:{port}"
        assert {address for address, at in listening("/proc/net/tcp") if at == port} == {"0100007F"}
        assert {address for address, at in listening("/proc/net/tcp6") if at == port} == set()
    finally:
        viewer.close()


# Licences


def requirements() -> set[str]:
    """Return the packages that pyproject.toml names, for building and for every extra."""
    toml = pytest.importorskip("tomllib" if sys.version_info >= (3, 11) else "tomli")
    project = toml.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needs = project["build-system"]["requires"] + project["project"]["dependencies"]
    needs += [need for extra in project["project"]["optional-dependencies"].values() for need in extra]
    return {match[0].lower() for match in map(re.compile(r"[\w-]+").match, needs) if match} - {"nacre"}


def listed() -> dict[str, str]:
    """Return the licences of third_party/README.md's table of Python packages."""
    text = (ROOT / "third_party" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w.-]+)` \|.*\| ([^|]+) \|$", text, re.MULTILINE)
    return {name.lower(): licence for name, licence in rows}


PERMISSIVE = {
    "0BSD", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0", "HPND", "ISC", "MIT", "MIT-CMU",
    "PSF-2.0", "Python-2.0", "Unlicense", "Zlib",
}  # fmt: skip
ACCEPTED = PERMISSIVE | {"MPL-2.0"}
"""The Mozilla licence asks for its own files alone: those that change them give the changes away."""

# How older metadata says it.
SPELLINGS = [
    (r"mozilla public license 2|mpl[ -]?2", "MPL-2.0"),
    (r"apache", "Apache-2.0"),
    (r"\bisc\b", "ISC"),
    (r"\bmit\b", "MIT"),
    (r"\bbsd\b.*2|2.clause", "BSD-2-Clause"),
    (r"\bbsd\b", "BSD-3-Clause"),
    (r"python software foundation|\bpsf\b", "PSF-2.0"),
    (r"public domain|unlicense", "Unlicense"),
]
# Whose metadata does not say; from the licence that is in the package.
READ = {"openexr": "BSD-3-Clause", "apsw": "Unlicense"}


def licence_of(name: str) -> str | None:
    """Return what the installed metadata says, as SPDX has it; None where it says nothing."""
    metadata = importlib.metadata.metadata(name)
    expression = metadata.get("License-Expression")
    if expression:
        return str(expression)
    said = [c.rpartition(" :: ")[2] for c in metadata.get_all("Classifier", []) if c.startswith("License ::")]
    said += [str(metadata.get("License") or "").splitlines()[0]] if metadata.get("License") else []
    for text in said:
        for pattern, licence in SPELLINGS:
            if re.search(pattern, text.lower()):
                return licence
    return READ.get(name.lower())


def parts(expression: str) -> set[str]:
    return set(re.findall(r"[\w.+-]+", expression)) - {"AND", "OR", "WITH"}


def test_every_requirement_is_listed_with_its_licence() -> None:
    assert set(listed()) == requirements()
    assert {name: licence for name, licence in listed().items() if not parts(licence) <= ACCEPTED} == {}


@pytest.mark.parametrize("name", sorted(listed()))
def test_installed_metadata_agrees_with_the_list(name: str) -> None:
    try:
        licence = licence_of(name)
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    assert licence is not None, f"{name} does not say its licence"
    assert parts(listed()[name]) <= parts(licence)
    assert parts(licence) <= ACCEPTED


def installed_below(name: str, seen: set[str]) -> set[str]:
    """Collect what a package needs, of what is installed."""
    seen.add(name)
    try:
        needs = importlib.metadata.requires(name) or []
    except importlib.metadata.PackageNotFoundError:
        return seen
    for need in needs:
        match = re.match(r"[\w.-]+", need)
        if match and "extra ==" not in need and match[0].lower() not in seen:
            installed_below(match[0].lower(), seen)
    return seen


def test_what_the_requirements_need_is_free_as_well() -> None:
    """Whatever `pip install nacre[all]` brings along, as far as it is installed here."""
    below: set[str] = set()
    for name in requirements():
        installed_below(name, below)
    licences = {}
    for name in below:
        try:
            licences[name] = licence_of(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    assert {
        n: licence for n, licence in licences.items() if licence is None or not parts(licence) <= ACCEPTED
    } == {}
    assert "numpy" in licences


# Continuous integration


def test_actions_are_pinned_to_commits() -> None:
    workflows = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
    if not workflows:
        pytest.skip("no workflows: this is no clone of the repository")
    used = [line for path in workflows for line in path.read_text().splitlines() if "uses:" in line]
    assert used
    unpinned = [
        line.strip() for line in used if not re.search(r"uses: [\w/-]+@[0-9a-f]{40} # v[\d.]+$", line)
    ]
    assert unpinned == []


def test_nothing_is_published_before_every_other_job_has_passed() -> None:
    workflow = ROOT / ".github" / "workflows" / "wheels.yml"
    if not workflow.exists():
        pytest.skip("no workflows: this is no clone of the repository")
    _, jobs = workflow.read_text().split("\njobs:\n")
    names = re.findall(r"^  ([\w-]+):", jobs, re.MULTILINE)
    (needed,) = re.findall(r"^  publish:.*?^    needs: \[(.*?)\]", jobs, re.MULTILINE | re.DOTALL)
    assert {"publish", *needed.split(", ")} == set(names)
