"""``nacre batch``."""

import sys

import pytest
from command_line import SIMULATION, fails, run

from nacre.cli.batch import _complain
from nacre.cli.terminal import CommandError
from nacre.reconstruction import BatchResult


@pytest.fixture(scope="module", name="scans")
def folder_of_recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    assert run("simulate", "built-in", "-o", folder / "cup", *SIMULATION).code == 0
    (folder / "broken").mkdir()
    (folder / "broken" / "depth.txt").write_text("no list\n")
    return folder


@pytest.mark.slow
def test_it_tells_of_each_recording_and_how_long_it_will_take(scans, tmp_path):
    pytest.importorskip("distributed")
    out = tmp_path / "out"
    words = ("batch", scans / "*", "-o", out, "--workers", 1, "--no-report")
    first = run(*words)
    assert first.code == 1
    lines = first.out.splitlines()
    assert lines[0].startswith("1 of 2: broken: failed: ")
    assert lines[0].endswith(" left)")
    assert lines[1].startswith("2 of 2: cup: reconstructed: ")
    assert first.err.startswith("error: 1 of 2 recordings failed: broken: ")
    again = run(*words[:-1], "--no-report", "--json")
    assert again.code == 1
    assert again.json["outcomes"] == {"failed": 1, "finished before": 1}
    assert (out / "index.html").is_file()


def results(**changes):
    good = {"outcome": "reconstructed", "level": "ok", "num_frames": 9, "num_tracked": 9}
    return [
        BatchResult("cup", "scans/cup", "out/cup", **good),
        BatchResult("mug", "scans/mug", "out/mug", **{**good, **changes}),
    ]


@pytest.mark.parametrize(
    ("changes", "code", "says"),
    [
        ({"outcome": "failed", "message": "no images"}, 1, "1 of 2 recordings failed: mug: no images"),
        ({"outcome": "not done"}, 1, "1 of 2 recordings are not done"),
        ({"num_tracked": 3, "message": "only 3 of 9"}, 3, "1 of 2 recordings lack frames: mug: only 3 of 9"),
    ],
)
def test_the_exit_code_says_what_went_wrong(changes, code, says):
    _complain(results())
    with pytest.raises(CommandError, match=says) as error:
        _complain(results(**changes))
    assert error.value.code == code


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("scans/cup",), "Missing option '--out'"),
        (("-o", "out"), "Missing argument 'SOURCE...'"),
        (("none*", "-o", "out"), "there is nothing that fits none*"),
        (("@no.txt", "-o", "out"), "no such file or directory: no.txt"),
        (("realsense", "-o", "out"), "sources must be recordings, and realsense is a camera"),
        (("scans/cup", "-o", "out", "--workers", 0), "--workers"),
        (("scans/cup", "-o", "out", "--format", "tumm"), "did you mean 'tum'"),
        (("scans/cup", "-o", "out", "--min-tracked", "nan"), "--min-tracked"),
        (("scans/cup", "-o", "out", "--set", "max_pionts=3"), "did you mean max_points?"),
    ],
)
def test_wrong_usage_is_told_before_anything_is_done(words, says, scans, tmp_path, monkeypatch):
    monkeypatch.chdir(scans.parent)
    words = [str(scans / "cup") if word == "scans/cup" else word for word in words]
    words = [str(tmp_path / "out") if word == "out" else word for word in words]
    assert says in fails(2, "batch", *words)
    assert not (tmp_path / "out").exists()


def test_without_dask_it_says_what_installs_it(scans, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert 'pip install "nacre[dask]"' in fails(2, "batch", scans / "cup", "-o", tmp_path / "out")
