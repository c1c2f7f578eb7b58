"""The table of a batch: ``OUT/index.html`` for people and ``OUT/index.json`` for programs."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nacre.evaluation.result import plain
from nacre.io.atomic import atomic_writer
from nacre.reconstruction.batch.page import render_batch
from nacre.reconstruction.batch.result import BatchResult
from nacre.reconstruction.batch.sources import INDEX_FILE, INDEX_PAGE
from nacre.system import __version__

_RARE = 20.0  # while recordings run it is written when so many times what it took last has gone by
_LEAST_SECONDS = 2.0


class Index:
    """
    The results of a batch, which come one by one, and the files that tell of them.

    Parameters
    ----------
    folder : Path
        The files are written here.
    results : sequence of BatchResult
        What there is of each recording before anything is done.
    """

    def __init__(self, folder: Path, results: Sequence[BatchResult]) -> None:
        self._folder = folder
        self._results = {result.name: result for result in results}
        self._start = time.monotonic()
        self._next = 0.0

    @property
    def results(self) -> list[BatchResult]:
        """All of them, in the order of the recordings."""
        return list(self._results.values())

    def add(self, result: BatchResult) -> None:
        """Note what became of a recording; write the files where it is time."""
        self._results[result.name] = result
        if time.monotonic() >= self._next:
            self.write()

    def write(self) -> None:
        """Write the files."""
        start = time.monotonic()
        text = json.dumps(plain(self.as_dict()), indent=2, allow_nan=False)
        self._write(INDEX_FILE, f"{text}\n")
        page = render_batch(self._folder.absolute().name, self.results, start - self._start)
        self._write(INDEX_PAGE, page)
        now = time.monotonic()
        self._next = now + max(_LEAST_SECONDS, _RARE * (now - start))

    def as_dict(self) -> dict[str, Any]:
        """Return what ``index.json`` says."""
        return {
            "nacre": __version__,
            "seconds": time.monotonic() - self._start,
            "num_recordings": len(self._results),
            "outcomes": dict(Counter(result.outcome for result in self.results)),
            "recordings": [result.as_dict() for result in self.results],
        }

    def _write(self, name: str, text: str) -> None:
        with atomic_writer(self._folder / name) as stream:
            stream.write(text.encode())
