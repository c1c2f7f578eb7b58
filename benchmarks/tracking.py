#!/usr/bin/env python3
"""
Measure tracking and models on simulated and real recordings, beside peers: one command.

It makes an environment of its own, installs this copy of nacre and the Python peers into it, runs each row of
the table, and writes results.json and a page. ``--only`` runs some rows; what earlier runs found of the
others is kept.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from run import HERE, ROOT, set_up


def parse() -> argparse.Namespace:
    """Read the command line."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    add = parser.add_argument
    add("--only", nargs="+", metavar="NAME", default=[], help="these rows, such as bunny12 or teddy")
    add(
        "--real",
        action="store_true",
        help="real recordings, everybody untuned: frames claimed, right and wrong",
    )
    add("--data", type=Path, default=ROOT.parent / "shared" / "data", help="folder of recordings and meshes")
    add("--output", type=Path, default=HERE / "results" / "tracking", help="folder of results.json")
    add("--work", type=Path, help="folder of simulated recordings and models (default: OUTPUT/work)")
    add("--page", type=Path, help="also write the page, such as docs/tracking.md; with --real its section")
    add("--peers", nargs="+", metavar="NAME", help="these peers; the others' results are kept")
    add("--no-peers", dest="peers", action="store_const", const=[], help="nacre; the peers' results are kept")
    add("--busy", action="store_true", help="mark the times: the machine does other things too")
    add("--env", type=Path, default=HERE / ".env", help="folder of the environment (kept for the next run)")
    add("--no-setup", action="store_true", help="take the environment as it is")
    return parser.parse_args()


def main() -> int:
    """Set up, measure, write."""
    options = parse()
    env = options.env.resolve()
    if not options.no_setup:
        set_up(env)
    options.work = options.work or options.output / "work"
    wanted = {
        key: str(value.resolve()) if isinstance(value, Path) else value
        for key, value in vars(options).items()
    }
    command = [env / "bin" / "python", "-m", "track", json.dumps(wanted)]
    return subprocess.run(command, cwd=HERE, env=os.environ, check=False).returncode


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, KeyboardInterrupt) as error:
        sys.exit(str(error))
