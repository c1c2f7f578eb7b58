"""The processes of a batch: as many as fill the machine, and no more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from nacre._internal import cluster as clusters


@pytest.mark.parametrize(
    ("workers", "num_recordings", "num_workers", "num_threads"),
    [
        (None, 100, 8, 1),  # one process for each processor is fastest
        (None, 3, 3, 2),  # fewer recordings than processors: each gets its share
        (None, 1, 1, 8),
        (2, 100, 2, 4),
        (16, 100, 16, 1),
    ],
)
def test_the_processors_are_divided_among_the_workers(
    workers: int | None,
    num_recordings: int,
    num_workers: int,
    num_threads: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(clusters, "default_threads", lambda: 8)
    options = clusters._local_cluster(SimpleNamespace(LocalCluster=dict), workers, num_recordings)
    assert options["n_workers"] == num_workers
    assert options["threads_per_worker"] == 1
    assert options["env"] == {"OMP_NUM_THREADS": str(num_threads)}


@pytest.mark.slow
def test_a_worker_has_its_share_of_threads_and_leaves_ctrl_c_to_the_batch(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "script.py"
    script.write_text(
        "import os, signal, nacre\n"
        "from nacre._internal import cluster\n"
        "def look():\n"
        "    return nacre.default_threads(), signal.getsignal(signal.SIGINT) is signal.SIG_IGN\n"
        "if __name__ == '__main__':\n"
        "    cluster.default_threads = lambda: 6\n"
        "    with cluster.cluster_client(None, 2, 9) as client:\n"
        "        print(*client.run(look).values())\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stdout == "(3, True) (3, True)\n"


def test_a_script_without_a_guard_is_told_about_it(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "script.py"
    script.write_text("import nacre\nnacre.batch('scan', 'out', workers=1)\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode != 0
    assert 'must call what starts them below if __name__ == "__main__":' in done.stderr
