"""Batches on real clusters whose workers, scheduler or disk fail: the same bytes, or what is missing."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import nacre
from nacre._internal import cluster as clusters
from nacre.io.folder_lock import lock_folder
from nacre.reconstruction.batch.run import _result_of
from nacre.reconstruction.batch.task import make_tasks

pytest.importorskip("typer")
distributed = pytest.importorskip("distributed")
from killed_runs import NACRE, results  # noqa: E402  they need the command line

from nacre.reconstruction.run_options import RunOptions  # noqa: E402

NAMES = ("bowl", "cup", "mug")
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.weekly) for seed in range(1, 6))]


@pytest.fixture(name="client")
def connected(cluster: Any) -> Iterator[Any]:
    """Return a client of the cluster, which has both workers."""
    with distributed.Client(cluster) as client:
        client.wait_for_workers(2)
        yield client


def on(cluster: Any, sources: Any, output: Path, **options: Any) -> list[nacre.reconstruction.BatchResult]:
    return nacre.batch(sources, output, scheduler=cluster.scheduler_address, report=False, **options)


def begin(scans: Path, output: Path, *more: Any) -> subprocess.Popen[str]:
    """Begin a batch of the good recordings as another process, which saves each after every frame."""
    good = [scans / name for name in NAMES]
    words = [*NACRE, "batch", *good, "-o", output, "--no-report", "--checkpoint-every", 1, *more]
    return subprocess.Popen(
        [str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def wait_until(happens: Callable[[], bool], seconds: float = 300.0) -> None:
    end = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)


def is_running(output: Path) -> bool:
    """Whether some recording is begun and not finished."""
    return any(output.glob("*/unfinished/journal.txt"))


def outcomes(output: Path) -> dict[str, str]:
    """Return what became of each recording, as the index tells."""
    index = json.loads((output / "index.json").read_text())
    return {recording["name"]: recording["outcome"] for recording in index["recordings"]}


def test_each_recording_gets_what_it_gets_alone_and_one_that_fails_stops_nothing(
    cluster: Any, scans: Path, alone: Any, tmp_path: Path
) -> None:
    told: list[str] = []
    found = on(cluster, scans, tmp_path, progress=lambda result: told.append(result.name))
    assert [result.name for result in found] == ["bowl", "broken", "cup", "mug"] == sorted(told)
    assert [result.has_results for result in found] == [True, False, True, True]
    assert {name: results(tmp_path / name) for name in NAMES} == alone
    on(cluster, scans, tmp_path)
    before = "finished before"
    assert outcomes(tmp_path) == {"bowl": before, "broken": "failed", "cup": before, "mug": before}


def test_the_table_tells_of_all(cluster: Any, scans: Path, tmp_path: Path) -> None:
    broken, cup = on(cluster, [scans / "broken", scans / "cup"], tmp_path)
    index = json.loads((tmp_path / "index.json").read_text())
    assert index["num_recordings"] == 2
    assert index["outcomes"] == {"failed": 1, "reconstructed": 1}
    assert index["recordings"] == [broken.as_dict(), cup.as_dict()]
    page = (tmp_path / "index.html").read_text()
    assert "depth.txt, line 1" in page
    assert cup.verdict in page
    assert '<a href="cup/model.ply">cup</a>' in page
    assert '<img loading="lazy" src="thumbnails/cup.webp"' in page
    assert (tmp_path / "thumbnails" / "cup.webp").is_file()


def test_a_callback_ends_a_batch_which_goes_on_when_called_again(
    cluster: Any, scans: Path, tmp_path: Path
) -> None:
    good = [scans / name for name in NAMES]
    found = on(cluster, good, tmp_path, progress=lambda result: False)
    assert sum(result.has_results for result in found) == 1
    assert {result.outcome for result in found} == {"reconstructed", "not done"}
    assert all(result.has_results for result in on(cluster, good, tmp_path))


@pytest.mark.parametrize("seed", SEEDS)
def test_workers_that_are_killed_change_no_byte(
    cluster: Any, client: Any, scans: Path, alone: Any, tmp_path: Path, seed: int
) -> None:
    rng = random.Random(seed)
    batch = begin(scans, tmp_path, "--scheduler", cluster.scheduler_address)
    wait_until(lambda: is_running(tmp_path))
    time.sleep(rng.uniform(0, 0.05))
    for pid in client.run(os.getpid).values():
        os.kill(pid, signal.SIGKILL)
    said = batch.communicate(timeout=300)[0]
    assert batch.returncode == 0, said
    assert {name: results(tmp_path / name) for name in NAMES} == alone


@pytest.mark.parametrize("seed", SEEDS)
def test_a_batch_that_is_killed_goes_on_to_the_same_bytes(
    scans: Path, alone: Any, tmp_path: Path, seed: int
) -> None:
    batch = begin(scans, tmp_path, "--workers", 1)
    wait_until(lambda: is_running(tmp_path))
    time.sleep(random.Random(seed).uniform(0, 0.2))
    batch.kill()
    batch.communicate()
    finished = {path.parent.name: path.stat().st_mtime_ns for path in tmp_path.glob("*/report.json")}
    again = begin(scans, tmp_path, "--workers", 2)
    said = again.communicate(timeout=300)[0]
    assert again.returncode == 0, said
    assert {name: results(tmp_path / name) for name in NAMES} == alone
    for name, written in finished.items():
        if not (tmp_path / name / "unfinished").exists() and outcomes(tmp_path)[name] == "finished before":
            assert (tmp_path / name / "report.json").stat().st_mtime_ns == written
    num_done_again = sum(outcome != "finished before" for outcome in outcomes(tmp_path).values())
    assert num_done_again <= len(NAMES) - len(finished) + 1  # no more than what was in flight


def test_a_scheduler_that_goes_away_is_told_with_what_is_missing(
    scans: Path, alone: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "_SECONDS_TO_CONNECT", 2)
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [
            *dask,
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            file,
        ],
        **silent,
    )
    wait_until(lambda: file.exists() and file.stat().st_size > 0)
    address = json.loads(file.read_text())["address"]
    worker = subprocess.Popen(
        [*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"], **silent
    )
    try:
        found = nacre.batch(
            scans, tmp_path / "out", scheduler=address, report=False, progress=lambda result: scheduler.kill()
        )
    finally:
        worker.kill()
        worker.wait()
        scheduler.kill()
        scheduler.wait()
    assert any(result.has_results or result.outcome == "failed" for result in found)
    missing = [result for result in found if result.outcome == "not done"]
    assert missing
    assert {result.message for result in missing} == {"the scheduler went away"}


def test_a_full_disk_on_one_worker_says_how_to_go_on(
    cluster: Any, client: Any, scans: Path, alone: Any, tmp_path: Path
) -> None:
    def fill_the_disk() -> None:
        def full(descriptor: int) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        os.fsync = full

    full, _ = client.run(os.getpid)
    client.run(fill_the_disk, workers=[full])
    good = [scans / name for name in NAMES]
    for result in on(cluster, good, tmp_path):
        assert result.has_results or (
            "no space left on device" in result.message
            and result.message.endswith("the same command again goes on with it")
        )
    client.restart_workers([full])
    assert all(result.has_results for result in on(cluster, good, tmp_path))
    assert {name: results(tmp_path / name) for name in NAMES} == alone


def test_a_batch_waits_for_no_other_in_its_folder(scans: Path, tmp_path: Path) -> None:
    lock = lock_folder(tmp_path)
    if lock is None:
        pytest.skip("no locks here")
    with pytest.raises(BlockingIOError, match="another nacre batch is writing to it"):
        nacre.batch(scans, tmp_path)
    os.close(lock)


def test_workers_that_run_several_tasks_in_one_process_are_refused(scans: Path, tmp_path: Path) -> None:
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address="127.0.0.1:0"
        ) as cluster,
        pytest.raises(ValueError, match=r"runs 2 tasks in one process.* --nthreads 1"),
    ):
        on(cluster, scans, tmp_path)


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"workers": 0}, ValueError, "workers must be"),
        ({"workers": "two"}, TypeError, "workers must be"),
        ({"scheduler": 8786}, TypeError, "scheduler must be an address, got 8786"),
        ({"overwrite": "yes"}, TypeError, "overwrite must be"),
        ({"progress": 3}, TypeError, "progress must be a function"),
        ({"camera": 3}, TypeError, "camera must be a path, got 3"),
        ({"attributes": ["heat"]}, TypeError, "attributes must be folders by their names"),
        ({"parameters": {}}, TypeError, "parameters must be nacre.ModelParameters"),
        ({"max_pionts": 5}, ValueError, "max_points"),
        ({"min_tracked": 2}, ValueError, "min_tracked must be 0 to 1"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_done(
    options: dict[str, Any], error: type[Exception], says: str, scans: Path, tmp_path: Path
) -> None:
    with pytest.raises(error, match=says):
        nacre.batch(scans, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_nobody_at_the_address_is_said_at_once(
    scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "_SECONDS_TO_CONNECT", 0.5)
    with pytest.raises(ConnectionError, match="no scheduler answers at"):
        nacre.batch(scans, tmp_path, scheduler="tcp://127.0.0.1:1")
    assert not (tmp_path / "index.json").exists()


def test_without_dask_the_command_that_installs_it_is_told(
    scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r'pip install "nacre\[dask\]"'):
        nacre.batch(scans, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_results_that_a_worker_wrote_to_another_disk_are_told(scans: Path, tmp_path: Path) -> None:
    (task,) = make_tasks({"cup": scans / "cup"}, RunOptions(""), nacre.ModelParameters(), tmp_path)
    elsewhere = dataclasses.replace(task.empty_result, outcome="reconstructed")
    result = _result_of(SimpleNamespace(result=lambda: elsewhere), task)  # type: ignore[arg-type]
    assert result.outcome == "failed"
    assert result.message.endswith("which is not seen here: all machines need one disk")
