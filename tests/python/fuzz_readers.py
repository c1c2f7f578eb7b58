"""
Fuzz nacre's readers, the hostile files of ``hostile_files`` and valid ones being the seeds.

    python tests/python/fuzz_readers.py KIND [--seconds 60] [--seed 0] [--corpus FOLDER]

damages files at random; with atheris (``pip install --group fuzz``) what it tries follows the branches that
it has seen, and what took a new one is kept in the corpus, from which the next run goes on. Check sums are
made right again in half of the files. KIND is one of those of ``hostile_files.READERS``. Whatever is neither
a result nor an error of nacre's is written to ``fuzz-findings/`` and ends the run with 1.

A file of the corpus is what a reader is given, after one byte that says which of the seeds' places it takes.
"""

import argparse
import contextlib
import ctypes
import importlib
import logging
import mmap
import os
import pkgutil
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
    with atheris.instrument_imports(include=["nacre", "rosbags"]):
        import nacre

        modules = [module.name for module in pkgutil.walk_packages(nacre.__path__, "nacre.")]
        for name in ("rosbags.highlevel", *modules):  # those, too, that are imported late
            if not name.endswith("__main__"):
                with contextlib.suppress(ImportError):
                    importlib.import_module(name)
else:
    import nacre
from hostile_files import CASES, READERS, Case, write
from hostile_files.damage import damaged, scratched
from hostile_files.seals import note_of, sealed, with_note
from hostile_files.valid import VALID

MOST_BYTES = 1 << 16
MOST_SECONDS = 2.0
MOST_MEMORY = 1 << 30  # then a new process goes on
KEPT_TOO_MUCH = 75  # the exit code of one that has more
FOLDERS = ("recording", "output", "run")  # of several files each


class Counts(ctypes.Structure):
    """How many files were read."""

    _fields_ = [(name, ctypes.c_int64) for name in ("files", "refused", "found")]


class Findings:
    """Runs a reader over files, and keeps what is neither a result nor nacre's own error."""

    def __init__(self, kind: str, folder: Path, keep: Path) -> None:
        self.kind = kind
        self.keep = keep
        self._known: set[str] = set()
        self.num = Counts.from_buffer(mmap.mmap(-1, ctypes.sizeof(Counts)))  # one for all forked processes
        # The places that a file may take: in each valid folder; in a hostile one that alone has such a file.
        self.homes: list[tuple[Case, Path, str]] = []
        self._seeds: dict[str, list[bytes]] = {}
        self._valid: dict[str, list[bytes]] = {}
        for case in (*VALID.values(), *CASES.values()):
            if case.reader != kind or case.pipes or case.links:
                continue
            for name, data in case.files.items():
                known = self._seeds.setdefault(self._sort_of(name), [])
                if not known or (case.name in VALID and kind in FOLDERS):
                    self.homes.append((case, write(case, folder / str(len(self.homes))), name))
                if len(data) <= MOST_BYTES and data not in known:
                    known.append(data)
                    if case.name in VALID:
                        self._valid.setdefault(self._sort_of(name), []).append(data)

    def _sort_of(self, name: str) -> str:
        return name if self.kind in FOLDERS else Path(name).suffix

    def seeds_of(self, home: int) -> list[bytes]:
        """Return the files of the corpus of seeds that may take a place."""
        return self._seeds[self._sort_of(self.homes[home][2])]

    def mutated(self, home: int, data: bytes, chance: random.Random) -> bytes:
        """Return what a file, or every third time a valid one of its sort, becomes by chance."""
        valid = self._valid.get(self._sort_of(self.homes[home][2]))
        if valid and chance.random() < 0.33:
            data = chance.choice(valid)
        if self.kind == "reconstruction" and (note := note_of(data)):
            return with_note(data, chance.choice((damaged, scratched))((note,), chance))
        if chance.random() < 0.5:
            data = scratched((data,), chance)
        else:
            data = damaged((data, *self.seeds_of(home)), chance)
        return sealed(data) if chance.random() < 0.5 else data

    def run_marked(self, data: bytes) -> None:
        """Read a file of the corpus, of which the first byte says what it is to be."""
        if data:
            self.run(data[0] % len(self.homes), data[1:])

    def run(self, home: int, data: bytes) -> None:
        """Read a file of these bytes."""
        case, path, name = self.homes[home]
        place = path / name if not case.opens else path.parent / name
        place.write_bytes(data)
        start = time.process_time()
        self.num.files += 1
        try:
            READERS[self.kind](path)
        except nacre.FileFormatError as error:
            str(error)
            self.num.refused += 1
        except FileNotFoundError:
            pass
        except Exception as error:
            self._found(name, data, repr(error))
        if time.process_time() - start > MOST_SECONDS:
            self._found(name, data, f"{time.process_time() - start:.1f} s")

    def __str__(self) -> str:
        return f"{self.kind}: {self.num.files} files, {self.num.refused} refused, {self.num.found} findings"

    def _found(self, name: str, data: bytes, what: str) -> None:
        if what[:40] in self._known:  # one file of each kind is enough
            return
        self._known.add(what[:40])
        self.num.found += 1
        self.keep.mkdir(parents=True, exist_ok=True)
        path = self.keep / f"{self.kind}-{self.num.found}-{Path(name).name}".replace(" ", "-")
        path.write_bytes(data)
        print(f"{path}: {what[:300]}", flush=True)


def main() -> int:
    """Fuzz one reader."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[1])
    parser.add_argument("kind", choices=READERS)
    parser.add_argument(
        "--seconds", type=float, default=60, help="0: what the corpus and the seeds hold, once"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--corpus", type=Path, help="a folder to go on from, and to keep what is new in")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-findings"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        findings = Findings(options.kind, Path(folder) / "files", options.keep)
        corpus = options.corpus or Path(folder) / "corpus"
        corpus.mkdir(parents=True, exist_ok=True)
        if atheris is None or options.seconds == 0:
            _at_random(findings, corpus, options.seed, options.seconds)
            return int(findings.num.found > 0)
        return _guided(findings, corpus, Path(folder), options.seed, options.seconds)


def memory() -> int:
    """Return the bytes that this process has; atheris frees no result of comparing arrays."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def _at_random(findings: Findings, corpus: Path, seed: int, seconds: float) -> None:
    """Try the corpus and the seeds, and then what they are when damaged."""
    end = time.monotonic() + seconds
    for path in sorted(corpus.iterdir()):
        findings.run_marked(path.read_bytes())
    homes = range(len(findings.homes))
    for home in homes:
        for data in findings.seeds_of(home):
            findings.run(home, data)
    chance = random.Random(seed)
    while time.monotonic() < end:
        home = chance.choice(homes)
        findings.run(home, findings.mutated(home, chance.choice(findings.seeds_of(home)), chance))
    print(findings)


def _guided(findings: Findings, corpus: Path, folder: Path, seed: int, seconds: float) -> int:
    """Let libFuzzer choose, in one child process after the other; return the last one's exit code."""
    seeds = folder / "seeds"
    seeds.mkdir()
    for home in range(len(findings.homes)):
        for i, data in enumerate(findings.seeds_of(home)):
            (seeds / f"{home}-{i}").write_bytes(bytes([home]) + data)
    findings.keep.mkdir(parents=True, exist_ok=True)
    end = time.monotonic() + seconds
    code = KEPT_TOO_MUCH
    while code == KEPT_TOO_MUCH and time.monotonic() < end:
        seed += 1
        child = os.fork()
        if child == 0:
            _choose(findings, [str(corpus), str(seeds), f"-seed={seed}"], end)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return 0 if code == KEPT_TOO_MUCH else code


def _choose(findings: Findings, options: list[str], end: float) -> None:
    """Run libFuzzer, which never returns, until it is time or too much memory is kept."""

    def leave(code: int) -> None:
        print(findings, flush=True)
        os._exit(code)

    def one(data: bytes) -> None:
        if time.monotonic() > end:
            leave(int(findings.num.found > 0))
        findings.run_marked(data)
        if findings.num.files % 500 == 0 and memory() > MOST_MEMORY:
            leave(1 if findings.num.found else KEPT_TOO_MUCH)

    def mutated(data: bytes, most: int, number: int) -> bytes:
        chance = random.Random(number)
        if not data or chance.random() < 0.5:
            data = atheris.Mutate(data, most)
            return (data[:1] + sealed(data[1:]) if chance.random() < 0.5 else data)[:most]
        home = data[0] % len(findings.homes)
        return (bytes([home]) + findings.mutated(home, data[1:], chance))[:most]

    limits = [f"-max_len={MOST_BYTES}", "-timeout=30", "-mutate_depth=2", "-verbosity=0"]
    limits += [f"-artifact_prefix={findings.keep}/{findings.kind}-"]
    atheris.Setup([sys.argv[0], *options, *limits], one, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
