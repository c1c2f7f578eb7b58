#!/usr/bin/env python3
"""
Measure nacre against its peers, side by side: one command that needs Python and a C++ compiler.

It makes an environment of its own, installs this copy of nacre and the Python peers into it, builds the C++
peers that the machine has, runs everything in turns on the same arrays, and writes results.json and
results.md.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
NEEDED = ["numpy", "scipy", "pillow", "cmake", "ninja"]
PYTHON_PEERS = ["pykdtree", "small_gicp", "open3d", "opencv-contrib-python-headless", "kiss-icp"]
DEBIAN_PACKAGES = {
    "nanoflann": ["libnanoflann-dev"],
    "flann": ["libflann-dev", "liblz4-dev"],
    "cgal": ["libcgal-dev", "libtbb-dev"],
    "pcl": ["libpcl-dev"],
}


def parse() -> argparse.Namespace:
    """Read the command line."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    most = min(2, len(os.sched_getaffinity(0)))
    add = parser.add_argument
    add("--quick", action="store_true", help="small sizes, all threads, less than three minutes")
    add("--only", nargs="+", metavar="NAME", default=[], help="these workloads; a name may end in *")
    add("--list", action="store_true", help="list the workloads")
    add(
        "--threads",
        help=f"numbers of threads, such as 1,2 (default: 1 and {most}, or {most} if quick)",
    )
    add("--repeats", type=int, default=5, help="turns of each contender (default: 5)")
    add("--output", type=Path, default=HERE / "results", help="folder of results.json and results.md")
    add("--env", type=Path, default=HERE / ".env", help="folder of the environment (kept for the next run)")
    add("--data", type=Path, help="folder of real recordings, for the loop")
    add("--no-setup", action="store_true", help="take the environment as it is")
    options = parser.parse_args()
    default = [most] if options.quick else sorted({1, most})
    options.threads = [int(count) for count in options.threads.split(",")] if options.threads else default
    return options


def run(*command: str | Path, path: Path | None = None) -> None:
    """Run a command, with a folder before the PATH; its output is the error if it fails."""
    environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}"} if path else None
    done = subprocess.run(command, text=True, capture_output=True, check=False, env=environment)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{(done.stdout + done.stderr)[-3000:]}")


def set_up(env: Path) -> None:
    """Install nacre and the peers; a peer that cannot be had is named and left out."""
    python = env / "bin" / "python"
    if not python.exists():
        venv.create(env, with_pip=True)
    print(f"installing nacre and its peers into {env}; the first time takes minutes", file=sys.stderr)
    pip = (python, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "install", *NEEDED)
    shutil.rmtree(env / "wheel", ignore_errors=True)
    run(*pip, "wheel", "--no-deps", "-w", env / "wheel", f"-Cbuild-dir={env / 'nacre'}", ROOT)
    run(*pip, "install", "--no-deps", "--force-reinstall", *(env / "wheel").glob("nacre*.whl"))
    for peer in PYTHON_PEERS:
        try:
            run(*pip, "install", "--prefer-binary", peer)
        except RuntimeError as error:
            print(f"{peer} is absent: pip cannot install it: {str(error).splitlines()[-1]}", file=sys.stderr)

    cmake, build, path = env / "bin" / "cmake", env / "peers", env / "bin"
    run(cmake, "-S", HERE / "cpp_peers", "-B", build, "-G", "Ninja", path=path)
    try:
        run(cmake, "--build", build, "--", "-k0", path=path)
    except RuntimeError as error:
        print(f"a C++ peer does not compile:\n{error}", file=sys.stderr)
    absent = [name for name in DEBIAN_PACKAGES if not (build / f"{name}.so").exists()]
    if absent:
        packages = [package for name in absent for package in DEBIAN_PACKAGES[name]]
        print(f"absent: {', '.join(absent)}. apt-get install {' '.join(packages)}", file=sys.stderr)


def main() -> int:
    """Set up, measure, write."""
    options = parse()
    env = options.env.resolve()
    if not options.no_setup:
        set_up(env)
    wanted = {key: str(value) if isinstance(value, Path) else value for key, value in vars(options).items()}
    wanted["output"] = str(options.output.resolve())
    wanted["wheel"] = str(next((env / "wheel").glob("nacre*.whl"), ""))
    environment = {**os.environ, "NACRE_BENCHMARK_PEERS": str(env / "peers")}
    if options.data:
        environment["NACRE_BENCHMARK_DATA"] = str(options.data.resolve())
    command = [env / "bin" / "python", "-m", "suite", json.dumps(wanted)]
    return subprocess.run(command, cwd=HERE, env=environment, check=False).returncode


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, KeyboardInterrupt) as error:
        sys.exit(str(error))
