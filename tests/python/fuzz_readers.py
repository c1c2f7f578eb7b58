"""
Fuzz nacre's readers, the hostile files of ``hostile_files`` and valid ones being the seeds.

    python tests/python/fuzz_readers.py KIND [--seconds 60] [--seed 0]

damages files at random; with atheris (``pip install atheris``, Python 3.11 to 3.13) what it tries follows
the branches that it has seen. KIND is one of those of ``hostile_files.READERS``. Whatever is neither a result
nor an error of nacre's is written to ``fuzz-findings/`` and ends the run with 1.
"""

import argparse
import logging
import random
import sys
import tempfile
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
try:
    import atheris
except ImportError:
    atheris = None
if atheris is not None and __name__ == "__main__":
    with atheris.instrument_imports(include=["nacre"]):
        import nacre
        import nacre.cli.config
        import nacre.datasets
        import nacre.io.images
        import nacre.io.points
        import nacre.viewer.written
else:
    import nacre
from hostile_files import CASES, READERS, Case, write
from hostile_files.damage import damaged
from hostile_files.valid import VALID

MOST_BYTES = 1 << 16
MOST_SECONDS = 2.0


class Findings:
    """Runs a reader over files, and keeps what is neither a result nor nacre's own error."""

    def __init__(self, kind: str, folder: Path, keep: Path) -> None:
        self.kind = kind
        self.keep = keep
        self._known: set[str] = set()
        self.num_runs = self.num_refused = self.num_found = 0
        cases = [case for case in (*CASES.values(), *VALID.values()) if case.reader == kind]
        # What lies beside a damaged file stays as it is in the first case that has such a file.
        self.seeds: dict[str, list[bytes]] = {}
        self.homes: dict[str, tuple[Case, Path, str]] = {}
        for case in sorted(cases, key=lambda case: case.name not in VALID):
            if case.pipes or case.links:
                continue
            for name, data in case.files.items():
                key = name if case.reader in ("recording", "output") else Path(name).suffix
                if len(data) <= MOST_BYTES:
                    self.seeds.setdefault(key, []).append(data)
                if key not in self.homes:
                    self.homes[key] = (case, write(case, folder / key.replace("/", "_")), name)
        self.keys = sorted(self.seeds.keys() & self.homes.keys())

    def run(self, key: str, data: bytes) -> None:
        """Read a file of these bytes."""
        case, path, name = self.homes[key]
        place = path / name if not case.opens else path.parent / name
        place.write_bytes(data)
        start = time.process_time()
        self.num_runs += 1
        try:
            READERS[self.kind](path)
        except nacre.FileFormatError as error:
            str(error)
            self.num_refused += 1
        except FileNotFoundError:
            pass
        except Exception as error:
            self._found(key, data, repr(error))
        if time.process_time() - start > MOST_SECONDS:
            self._found(key, data, f"{time.process_time() - start:.1f} s")

    def _found(self, key: str, data: bytes, what: str) -> None:
        if what[:40] in self._known:  # one file of each kind is enough
            return
        self._known.add(what[:40])
        self.num_found += 1
        self.keep.mkdir(exist_ok=True)
        path = self.keep / f"{self.kind}-{self.num_found}-{Path(key).name}".replace(" ", "-")
        path.write_bytes(data)
        print(f"{path}: {what[:300]}", flush=True)


def main() -> int:
    """Fuzz one reader."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[1])
    parser.add_argument("kind", choices=READERS)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("fuzz-findings"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    end = time.monotonic() + options.seconds
    with tempfile.TemporaryDirectory() as folder:
        findings = Findings(options.kind, Path(folder), options.keep)
        if atheris is not None:
            _guided(findings, options.seed, options.seconds)
        chance = random.Random(options.seed)
        while time.monotonic() < end:
            key = chance.choice(findings.keys)
            findings.run(key, damaged(findings.seeds[key], chance))
        print(f"{findings.num_runs} files, {findings.num_refused} refused, {findings.num_found} findings")
    return int(findings.num_found > 0)


def _guided(findings: Findings, seed: int, seconds: float) -> None:
    """Let libFuzzer choose; it ends the process itself."""
    corpus = tempfile.mkdtemp()
    for k, key in enumerate(findings.keys):
        for i, data in enumerate(findings.seeds[key]):
            (Path(corpus) / f"{k}-{i}").write_bytes(bytes([k]) + data)
    end = time.monotonic() + seconds

    def one(data: bytes) -> None:
        if time.monotonic() > end:
            print(f"{findings.num_runs} files, {findings.num_refused} refused, {findings.num_found} findings")
            sys.stdout.flush()
            import os

            os._exit(int(findings.num_found > 0))
        if data:
            findings.run(findings.keys[data[0] % len(findings.keys)], data[1:])

    atheris.Setup(
        [sys.argv[0], corpus, f"-seed={seed + 1}", f"-max_len={MOST_BYTES}", "-timeout=30", "-verbosity=0"],
        one,
    )
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
