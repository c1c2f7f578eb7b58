"""Which recordings a batch has, and what each is called."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from recording_folders import write_plain, write_redwood

import nacre
from nacre.reconstruction.batch.sources import find_recordings


@pytest.fixture(name="place")
def folder_of_recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return ``scans`` with the recordings cup and mug, a bag and notes; it is where we are."""
    for name in ("cup", "mug"):
        write_plain(tmp_path / "scans" / name)
    (tmp_path / "scans" / "walk.bag").write_bytes(b"")
    (tmp_path / "scans" / "notes.md").write_text("of June")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_recording_is_called_as_its_folder_or_its_file(place: Path) -> None:
    assert find_recordings("scans/cup") == {"cup": place / "scans/cup"}
    assert find_recordings([Path("scans/mug"), "scans/walk.bag"]) == {
        "mug": place / "scans/mug",
        "walk": place / "scans/walk.bag",
    }


def test_a_folder_of_recordings_stands_for_those_in_it(place: Path) -> None:
    assert list(find_recordings("scans")) == ["cup", "mug", "walk"]


def test_a_recording_that_is_named_twice_is_there_once(place: Path) -> None:
    assert list(find_recordings(["scans/mug", "scans", place / "scans/mug/"])) == ["mug", "cup", "walk"]


def test_patterns_are_matched_in_alphabetical_order(place: Path) -> None:
    assert list(find_recordings("scans/?u*")) == ["cup", "mug"]
    assert list(find_recordings("**/cup")) == ["cup"]


def test_a_list_names_paths_and_patterns_relative_to_itself(place: Path, monkeypatch: Any) -> None:
    (place / "list.txt").write_text("# the good ones\n\nscans/mug\n  scans/c*  \n")
    (place / "elsewhere").mkdir()
    monkeypatch.chdir(place / "elsewhere")
    assert list(find_recordings("@../list.txt")) == ["mug", "cup"]


def test_what_is_not_there_is_left_to_fail_alone(place: Path) -> None:
    assert find_recordings("scans/jug") == {"jug": place / "scans/jug"}


def test_those_of_one_name_have_their_parents_names_too(place: Path) -> None:
    for day in ("monday", "tuesday"):
        write_redwood(place / day / "cup")
    names = {"monday-cup", "tuesday-cup", "mug"}
    assert set(find_recordings(["monday/cup", "scans/mug", "tuesday/cup"])) == names
    assert set(find_recordings(["tuesday/cup", "monday/cup", "scans/mug"])) == names  # whatever the order


def test_files_that_differ_by_their_suffix_keep_it(place: Path) -> None:
    (place / "scans" / "walk.mcap").write_bytes(b"")
    assert list(find_recordings("scans/walk.*")) == ["walk.bag", "walk.mcap"]


def test_no_folder_is_called_as_what_a_batch_writes_itself(place: Path) -> None:
    write_plain(place / "scans" / "Thumbnails")
    assert list(find_recordings("scans/Thumbnails")) == ["scans-Thumbnails"]


def test_names_that_parents_do_not_tell_apart_are_numbered(place: Path) -> None:
    paths = [place / "a" / "b-c", place / "a-b" / "c", place / "a-b" / "b-c", place / "a" / "c"]
    for path in paths:
        write_plain(path)
    assert len(find_recordings(paths)) == 4


@pytest.mark.parametrize(
    ("sources", "error", "says"),
    [
        ("scans/x*", FileNotFoundError, "nothing that fits scans/x"),
        ("@missing.txt", FileNotFoundError, "missing.txt"),
        ("@empty.txt", nacre.FileFormatError, "empty.txt: it names no recording"),
        ("@binary.txt", nacre.FileFormatError, "binary.txt"),
        ([], ValueError, "sources must name at least one recording, got none"),
        ("", ValueError, "sources must be paths of recordings, got ''"),
        (["scans/cup", "a\0b"], ValueError, "sources must be paths of recordings, got"),
        (3, TypeError, "sources must be paths of recordings, got int"),
        (["scans/cup", None], TypeError, "sources must be paths of recordings, got None"),
    ],
)
def test_what_is_refused(place: Path, sources: Any, error: type[Exception], says: str) -> None:
    (place / "empty.txt").write_text("# nothing\n")
    (place / "binary.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(error, match=says.replace("*", r"\*")):
        find_recordings(sources)
