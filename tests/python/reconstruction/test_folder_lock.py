"""Two runs that would write to one folder: the second is refused, the first is not disturbed."""

import errno
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("typer")
from killed_runs import command, killed_after, plain_page, recording_with_gaps, results, undisturbed_results  # noqa: F401  fixtures

from nacre.reconstruction.resume import UnfinishedRun


def test_the_second_is_refused_and_the_first_is_not_disturbed(
    recording: Path,
    undisturbed: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "o"
    whole, refused = UnfinishedRun.add, []

    def add(self: UnfinishedRun, *more: Any) -> None:
        whole(self, *more)
        if not refused:
            before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
            refused.append(command("reconstruct", "--resume", out))
            refused.append(command("reconstruct", recording, "-o", out))
            assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before

    monkeypatch.setattr(UnfinishedRun, "add", add)
    assert command("reconstruct", recording, "-o", out)[0] == 0
    for code, _, error in refused:
        assert code == 2
        assert error.startswith(f"error: another nacre reconstruct is writing to {out}: wait until")
    assert len(refused) == 2
    assert results(out) == undisturbed
    assert command("reconstruct", recording, "-o", out)[0] == 0


def test_a_killed_one_holds_nothing(recording: Path, undisturbed: Any, tmp_path: Path) -> None:
    killed_after(2, "reconstruct", recording, "-o", tmp_path / "o")
    code = """if True:
        import sys, time
        from nacre.io.folder_lock import lock_folder
        lock_folder(sys.argv[1])
        print("held", flush=True)
        time.sleep(60)
    """
    with subprocess.Popen([sys.executable, "-c", code, tmp_path / "o"], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        assert command("reconstruct", "--resume", tmp_path / "o")[0] == 2
        other.kill()
    assert command("reconstruct", "--resume", tmp_path / "o")[0] == 0
    assert results(tmp_path / "o") == undisturbed


def test_on_a_disk_without_locks_nothing_is_held(
    recording: Path,
    undisturbed: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import fcntl

    def flock(*_: Any) -> None:
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr(fcntl, "flock", flock)
    assert command("reconstruct", recording, "-o", tmp_path / "o")[0] == 0
    assert results(tmp_path / "o") == undisturbed
