"""
Hostile point files in nacre and in other libraries: who tells, who is silent, who crashes or hangs.

    python benchmarks/damaged_points.py [--python PATH]

reads the PLY and PCD files of ``tests/python/hostile_files`` with nacre and with what is there of Open3D,
OpenCV, meshio and trimesh, each in a process of its own that is started again where it dies. ``--python`` is
another interpreter, in whose environment the others are. ``--data FOLDER`` adds files: all
those in it but ok.ply and nan.ply are broken.
"""

import argparse
import json
import select
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1] / "tests" / "python"
SECONDS = 5.0
QUIET = "import open3d\nopen3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)\n"
READ = {
    "nacre": "import nacre\ndef read(p): return len(nacre.read_points(p))",
    "Open3D": f"{QUIET}def read(p): return len(open3d.io.read_point_cloud(p).points)",
    "Open3D (tensor)": QUIET + "def read(p): return len(open3d.t.io.read_point_cloud(p).point.positions)",
    "OpenCV": "import cv2\ndef read(p):\n  v = cv2.loadPointCloud(p)[0]\n"
    "  return 0 if v is None else v.size // 3",
    "meshio": "import meshio\ndef read(p): return len(meshio.read(p).points)",
    "trimesh": "import trimesh\ndef read(p): return len(getattr(trimesh.load(p), 'vertices', ()))",
}
ENDINGS = {"nacre": (".ply", ".pcd"), "Open3D": (".ply", ".pcd"), "Open3D (tensor)": (".ply", ".pcd")}
WORKER = """
import json, sys
{code}
print("ready", flush=True)
for line in sys.stdin:
    try:
        said = f"{{read(line.strip())}} points"
    except Exception as error:
        said = "error " + type(error).__name__
    print("ANSWER " + said, flush=True)
"""


class Reader:
    """A process that reads files with a library."""

    def __init__(self, python: str, name: str) -> None:
        self.command = [python, "-c", WORKER.format(code=READ[name])]
        self.process: subprocess.Popen[str] | None = None

    def start(self) -> bool:
        """Start the process; say whether the library is there."""
        self.process = subprocess.Popen(
            self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        return self._line("ready", 120) is not None

    def read(self, path: Path) -> str:
        """Return what comes of a file: told, empty, points, exit, crash or hang."""
        if self.process is None and not self.start():
            return "exit"
        assert self.process is not None
        assert self.process.stdin is not None
        self.process.stdin.write(f"{path}\n")
        self.process.stdin.flush()
        line = self._line("ANSWER ", SECONDS)
        if line is None:
            code = self.process.poll()
            self.close()
            return "hang" if code is None else "crash" if code < 0 else "exit"
        if line.startswith("error"):
            return "told"
        return "empty" if line.startswith("0 ") else "points"

    def _line(self, start: str, seconds: float) -> str | None:
        assert self.process is not None
        assert self.process.stdout is not None
        while select.select([self.process.stdout], [], [], seconds)[0]:
            line = self.process.stdout.readline()
            if not line:
                self.process.wait()
                return None
            if line.startswith(start):
                return line.removeprefix(start)
        return None

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


def broken_files(folder: Path, data: Path | None) -> list[Path]:
    """Write the hostile point files, and return them and those of a folder of others."""
    sys.path.insert(0, str(TESTS))
    from hostile_files import CASES, write

    cases = [case for case in CASES.values() if case.reader == "points"]
    found = [write(case, folder) for case in cases]
    if data is not None:
        found += [path for path in sorted(data.glob("*.ply")) if path.name not in ("ok.ply", "nan.ply")]
    return found


def main() -> None:
    """Print a table, and what was crashed, hung or ended by which file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[1])
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--only", nargs="*", default=list(READ))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    kinds = ("told", "empty", "points", "exit", "crash", "hang")
    results: dict[str, dict[str, str]] = {}
    print(f"{'':16} files" + "".join(f"{kind:>8}" for kind in kinds))
    with tempfile.TemporaryDirectory() as folder:
        files = broken_files(Path(folder), options.data)
        for name in options.only:
            reader = Reader(sys.executable if name == "nacre" else options.python, name)
            if not reader.start():
                print(f"{name:16} is not installed")
                continue
            mine = [path for path in files if path.suffix in ENDINGS.get(name, (".ply",))]
            results[name] = {f"{path.parent.name}/{path.name}": reader.read(path) for path in mine}
            reader.close()
            counts = Counter(results[name].values())
            print(f"{name:16} {len(mine):5}" + "".join(f"{counts[kind]:8}" for kind in kinds), flush=True)
    if options.json is not None:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
