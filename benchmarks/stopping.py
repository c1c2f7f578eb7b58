"""
Stop ``nacre reconstruct`` by a signal and measure how long it takes to save the run and exit.

More options are those of nacre reconstruct.

    python benchmarks/stopping.py tum-fr3-teddy --after 195 --set spacing=0.002
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import nacre
from nacre.reconstruction.journal import read_journal

NACRE = (sys.executable, "-c", "from nacre.cli import main; main()")


def main() -> None:
    """Do it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("--after", type=int, default=100, metavar="FRAMES")
    arguments, options = parser.parse_known_args()
    for number in (signal.SIGINT, signal.SIGTERM):
        with tempfile.TemporaryDirectory() as name:
            out = Path(name) / "out"
            words = [*NACRE, "reconstruct", str(arguments.recording), "-o", str(out), *options]
            running = subprocess.Popen(words, stdout=subprocess.DEVNULL)
            journal = out / "unfinished" / "journal.txt"
            while not journal.exists() or len(read_journal(journal)[0]) < arguments.after:
                time.sleep(0.02)
            ticks = Path(f"/proc/{running.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
            before = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
            start = time.monotonic()
            running.send_signal(number)
            _, status, usage = os.wait4(running.pid, 0)
            took = time.monotonic() - start
            running.returncode = os.waitstatus_to_exitcode(status)
            points = len(nacre.read_points(out / "model.ply"))
            size = (out / "unfinished" / "checkpoint").stat().st_size / 1e6
            cpu = usage.ru_utime + usage.ru_stime - before
            print(
                f"{number.name}: exit {running.returncode} after {took:.2f} s ({cpu:.2f} s of CPU time), "
                f"{len(read_journal(journal)[0])} frames, {points} points, checkpoint {size:.1f} MB"
            )


if __name__ == "__main__":
    main()
