"""The rules of the house, read from the source files themselves."""

import ast
import importlib.util
import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import nacre

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs" / "extensions"))
import limit_lines  # noqa: E402 - of the documentation

# The folder of cpp/src that a public header belongs to.
PUBLIC = {
    "base": ["cancel", "checkpoint", "system", "types", "version"],
    "spatial": ["cubes", "kdtree", "normals"],
    "mesh": ["mesh"],
    "camera": ["camera"],
    "depth": ["depth", "depth_calibration"],
    "simulation": ["rendering", "simulation"],
    "region": ["region"],
    "registration": ["global_registration", "registration"],
    "consolidation": ["consolidation"],
    "fusion": ["fusion"],
    "tracking": ["tracking_options", "tracking_report"],
    "model": ["frame_report", "model", "model_options"],
}
# The folders of cpp/src from the bottom up: an include may only point to an earlier one.
ORDER = [
    "simd",
    "base",
    "spatial",
    "mesh",
    "camera",
    "depth",
    "simulation",
    "region",
    "registration",
    "keypoints",
    "outlines",
]
ORDER += ["consolidation", "fusion", "tracking", "loops", "deformation", "model"]
FOLDER = {name: folder for folder, names in PUBLIC.items() for name in names}
HEADERS = sorted((ROOT / "cpp" / "include" / "nacre").glob("*.hpp"))
CPP = ROOT / "cpp" / "src"
SOURCES = sorted(CPP.rglob("*.[ch]pp"))
FOLDERS = ("cpp", "python", "tests", "examples", "benchmarks", "docs", "third_party", ".ci", ".github")
CODE = {".py", ".pyi", ".cpp", ".hpp", ".cmake", ".txt", ".toml", ".yml", ".yaml", ".json", ".in", ".sh", ""}
TEXT = CODE | {".md"}
GENERATED = {"__pycache__", ".env", "results", ".hypothesis"}  # what git ignores


def files(*folders: str, suffixes: set[str] = TEXT) -> list[Path]:
    """List the text files below some folders, or of the whole repository; not this very file."""
    found = [path for folder in folders or FOLDERS for path in (ROOT / folder).rglob("*")]
    found += [] if folders else [path for path in ROOT.iterdir() if path.name != ".git"]
    return sorted(
        path
        for path in found
        if path.is_file()
        and path.suffix in suffixes
        and GENERATED.isdisjoint(path.parts)
        and path != Path(__file__).resolve()
    )


def lines_matching(pattern: str, paths: list[Path]) -> list[str]:
    """List the lines that match, as file:line: text."""
    return [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in paths
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(pattern, line)
    ]


def includes(path: Path) -> list[str]:
    """List the names that a C++ file includes."""
    return re.findall(r'^\s*#\s*include\s+[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE)


def included(path: Path) -> list[Path]:
    """List the files of the library that a C++ file includes."""
    found = [folder / name for name in includes(path) for folder in (HEADERS[0].parents[1], CPP)]
    return [file for file in found if file.is_file()]


def folder_of(path: Path) -> str:
    """Return the folder of cpp/src that a file belongs to."""
    return FOLDER[path.stem] if path in HEADERS else path.relative_to(CPP).parts[0]


def module_of(path: Path) -> tuple[str, str]:
    """Return what names a header and its source as one."""
    return folder_of(path), path.stem


def circles(graph: dict[Any, set[Any]]) -> set[Any]:
    """Return the modules that are left when those that need none of the rest go, again and again."""
    left = dict(graph)
    while free := [name for name, needed in left.items() if needed.isdisjoint(left)]:
        for name in free:
            del left[name]
    return set(left)


def test_every_public_header_has_its_folder() -> None:
    assert sorted(path.stem for path in HEADERS) == sorted(FOLDER)
    assert {path.relative_to(CPP).parts[0] for path in SOURCES} == set(ORDER)


@pytest.mark.parametrize("folder", ORDER)
def test_includes_point_to_earlier_folders(folder: str) -> None:
    for path in (path for path in [*HEADERS, *SOURCES] if folder_of(path) == folder):
        later = {folder_of(file) for file in included(path)} - set(ORDER[: ORDER.index(folder) + 1])
        assert later == set(), path


def test_no_modules_include_each_other_in_a_circle() -> None:
    graph: dict[tuple[str, str], set[tuple[str, str]]] = {}
    for path in [*HEADERS, *SOURCES]:
        needed = {module_of(file) for file in included(path)} - {module_of(path)}
        graph.setdefault(module_of(path), set()).update(needed)
    assert circles(graph) == set()
    assert circles({("a", "a"): {("b", "b")}, ("b", "b"): {("a", "a")}, ("c", "c"): set()}) != set()


def python_modules(root: Path) -> dict[str, Path]:
    """Return the modules below a folder by their names."""
    paths = {path: path.relative_to(root).with_suffix("").parts for path in root.rglob("*.py")}
    return {".".join(p[:-1] if p[-1] == "__init__" else p): path for path, p in paths.items()}


MODULES = python_modules(ROOT / "python")


def imported(name: str, path: Path, modules: dict[str, Path]) -> set[str]:
    """Return what a module imports, at any time or for types alone, and the packages that come with it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {part if part in modules else node.module for part in whole}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    packages = {package for module in found for package in enclosing(module)[1:]}
    return ((found | packages) & modules.keys()) - {name} - set(enclosing(name))


def enclosing(module: str) -> list[str]:
    """Return the packages that a module is in, the outermost first."""
    parts = module.split(".")
    return [".".join(parts[:length]) for length in range(1, len(parts))]


@pytest.mark.parametrize(
    ("folder", "module", "needed"),
    [
        ("python", "nacre.reconstruction.steps", "nacre.run_data.frame_record"),
        ("benchmarks", "suite.registry", "suite.workloads.depth"),
    ],
)
def test_no_python_modules_import_each_other_in_a_circle(folder: str, module: str, needed: str) -> None:
    modules = MODULES if folder == "python" else python_modules(ROOT / folder)
    graph = {name: imported(name, path, modules) for name, path in modules.items()}
    assert needed in graph[module]  # so that the graph is not empty
    assert circles(graph) == set()


def test_nothing_in_the_package_imports_the_names_that_it_shows_to_users() -> None:
    paths = [path for path in files("python/nacre", suffixes={".py"}) if "cli" not in path.parts]
    found = lines_matching(r"^\s*from nacre import (?!_core$)", paths)
    assert [line for line in found if not line.startswith("python/nacre/__init__.py")] == []


# Folders whose numbers decide about data, and stand in their limits.hpp; those before only decide how fast.
DECIDING = ["camera", "depth", "simulation", "region", "registration", "keypoints", "outlines"]
DECIDING += ["consolidation", "fusion", "tracking", "loops", "deformation", "model"]
# What decides nothing about data: sizes of blocks and arrays, names of values.
STRUCTURE = "block_size capacity border right_border tile_size size side radius shift group per_chunk"
STRUCTURE += " version_at bytes_per_pixel none any nothing missing largest infinity nan reach step kWordBits"
STRUCTURE += " unknown never no_limit step_block equation_block cloud_block phi"
STRUCTURE += " kBorder kOverhang kRadius kStep num_bins band_rows points_per_block nodes_per_task"
STRUCTURE += " blended dropout_stream log2_e planes_at_once nobody magic not_measured sealed_header_size"


@pytest.mark.parametrize("folder", DECIDING)
def test_numbers_that_decide_stand_in_limits(folder: str) -> None:
    sources = [
        path for path in SOURCES if path.relative_to(CPP).parts[0] == folder and path.name != "limits.hpp"
    ]
    number = (
        r"constexpr (?:double|float|int|std::\w+|Eigen::Index) (?!(?:"
        + "|".join(STRUCTURE.split())
        + r")\b)\w+ = "
    )
    assert lines_matching(number, sources) == []
    assert limit_lines.numbers_of(CPP / folder / "limits.hpp")


@pytest.mark.parametrize("folder", ["base", *DECIDING])
def test_each_number_is_guarded_by_something_that_exists(folder: str) -> None:
    """A test, a case of benchmarks/cases.py, a row of docs/tracking.md, a kind of failures.py, or a path."""
    known = {path.stem for kind in ("py", "cpp") for path in (ROOT / "tests").rglob(f"test_*.{kind}")}
    for name in ("cases.py", "track/table.py", "failures.py"):
        known |= set(re.findall(r"\"([\w-]+)\"", (ROOT / "benchmarks" / name).read_text(encoding="utf-8")))
    simulated = re.compile(r"(bunny|homer|spot|fandisk)\d+|\w+-kinect\d+|poster\d+(-gray)?")
    for number in limit_lines.numbers_of(CPP / folder / "limits.hpp"):
        for guard in number.guard.split(", "):
            assert guard in known or simulated.fullmatch(guard) or (ROOT / guard).exists(), number


def test_the_tests_of_a_folder_are_in_a_folder_of_its_name() -> None:
    tests = (ROOT / "tests" / "cpp").rglob("test_*.cpp")
    assert {path.parent.name for path in tests} <= set(ORDER)


@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.stem)
def test_public_headers_include_eigen_and_the_standard_library_only(path: Path) -> None:
    for name in includes(path):
        assert name.startswith(("nacre/", "Eigen/")) or re.fullmatch(r"[a-z_]+", name), name
        assert name != "iostream"
        if name.startswith("nacre/"):
            assert (ROOT / "cpp" / "include" / name).exists(), f"{name} is private"


def test_only_the_two_backends_know_threads() -> None:
    threads = re.compile(r"#include <thread>|#include <omp\.h>|#include <pthread\.h>|pragma\s+omp")
    knowing = {path.name for path in [*HEADERS, *SOURCES] if threads.search(path.read_text())}
    assert knowing == {"parallel_openmp.cpp", "parallel_threads.cpp"}


def test_only_the_bindings_know_pybind11() -> None:
    paths = files("cpp", "tests", "examples", suffixes={".cpp", ".hpp"})
    assert lines_matching(r"pybind11", paths) == []


def test_the_bindings_include_public_headers_only() -> None:
    for path in files("python", suffixes={".cpp", ".hpp"}):
        assert set(included(path)) <= set(HEADERS), path.name


def test_only_the_facade_touches_the_extension_module() -> None:
    outside = files("examples", "benchmarks", "docs", suffixes={".py", ".md"})
    for folder in ROOMS[1:]:
        outside += files(f"python/nacre/{folder}", suffixes={".py"})
    assert lines_matching(r"\b_core\b", outside) == []


# The Python package from the bottom up: the facade's modules, and the packages behind it. What the facade's
# functions and type checkers import does not count: it gives users files and pictures of its results.
ROOMS = ["facade", "pictures", "evaluation", "io", "out_of_core", "datasets", "run_data"]
ROOMS += ["viewer", "report", "reconstruction", "cli"]


def imported_modules(path: Path) -> set[str]:
    """Collect the modules of the package that a file imports when it is imported itself."""
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("nacre."):
            found.add(str(node.module))
        elif isinstance(node, ast.ImportFrom) and node.module == "nacre":
            found |= {f"nacre.{alias.name}" for alias in node.names}
    return found


def room(module: str) -> str:
    """Return the folder of a module, or the facade: which all that is private in it belongs to."""
    name = module.split(".")[1]
    if name == "__main__":  # the command line, too: python -m nacre
        return "cli"
    return name if name in ROOMS else "facade"


@pytest.mark.parametrize(
    "path", sorted((ROOT / "python" / "nacre").rglob("*.py")), ids=lambda path: path.stem
)
def test_python_modules_import_what_is_below_them(path: Path) -> None:
    name = ".".join(path.relative_to(ROOT / "python").with_suffix("").parts) + "."
    own = room(name)
    above = set(ROOMS[ROOMS.index(own) + 1 :])
    needed = imported_modules(path) if own == "facade" else imported(name, path, MODULES) - {"nacre"}
    assert {module for module in needed if room(module) in above} == set()


def test_nothing_below_the_command_line_knows_it() -> None:
    """Not even a function, when it is called: who embeds nacre has no command line."""
    above = (ROOT / "python/nacre/cli", ROOT / "python/nacre/__main__.py")
    below = [
        path
        for path in files("python/nacre", suffixes={".py"})
        if not any(path.is_relative_to(part) for part in above)
    ]
    assert lines_matching(r"(from|import) nacre\.cli", below) == []


def test_no_build_depends_on_the_machine() -> None:
    # What nacre is measured against may be built for the machine: nothing of it is installed.
    paths = [path for path in files(suffixes=CODE) if path.parent.name != "cpp_peers"]
    assert lines_matching(r"-march=native|-ffast-math|-Ofast", paths) == []
    assert lines_matching(r"""(^|[\s"'(=`])/(home|root|work|tmp|Users)/""", files()) == []


def test_public_names_are_complete_and_documented() -> None:
    assert len(nacre.__all__) == len(set(nacre.__all__))
    for name in nacre.__all__:
        value = getattr(nacre, name)
        if inspect.isclass(value) or inspect.isroutine(value):
            assert inspect.getdoc(value), name


def test_the_stub_fits_the_extension_module() -> None:
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is missing: pip install --group dev")
    command = [
        sys.executable,
        "-m",
        "mypy.stubtest",
        "nacre._core",
        "--mypy-config-file",
        str(ROOT / "pyproject.toml"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    # Stubs cannot say that pybind11 classes have a metaclass, that some have no constructor, and what
    # pybind11 keeps in an enumeration.
    unsayable = (
        "is inconsistent, metaclass differs",
        '__init__ is inconsistent, stub does not have *args parameter "args"',
        "__pybind11_native_enum__ is not present in stub",
    )
    errors = [
        line
        for line in done.stdout.splitlines()
        if line.startswith("error:") and not line.endswith(unsayable)
    ]
    assert "checked 1 module" in done.stdout, done.stdout + done.stderr
    assert errors == [], done.stdout


def test_continuous_integration_runs_the_readmes_command() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    (pattern,) = re.findall(r"grep --max-count=1 '(.+)' README\.md", script)
    assert len(re.findall(pattern, (ROOT / "README.md").read_text(), re.MULTILINE)) == 1
