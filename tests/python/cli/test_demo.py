"""``nacre demo``."""

import pytest
from command_line import Run, run, strict_json


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("cli") / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nacre.report.pictures._SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._MAIN_SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._CAMERA_SIZE", (60, 45))
        return out, run("demo", "-o", out, "--views", 3, "--step", 15)


def test_tells_figures_and_files(demo):
    out, result = demo
    assert result.code == 0, result.err
    assert "starting from the previous pose" in result.out
    for words in (
        "frames tracked",
        "3 of 3",
        "pose error",
        "RMS",
        "completeness",
        "uniformity",
        str(out),
    ):
        assert words in result.out


def test_writes_files_and_pictures(demo):
    out, _ = demo
    report = strict_json(out / "report.json")
    assert report["surface_accuracy"]["rms"] < 0.001
    assert report["completeness"]["tau"] == [0.002, 0.003, 0.005]
    assert report["pose_error"]["translation_max"] < 0.005
    assert report["num_tracked"] == 3
    names = {path.stem for path in (out / "pictures").glob("*.png")}
    assert {"model", "front", "back", "depth-before", "depth-after"} <= names
    for path in (out / "pictures").iterdir():
        assert path.read_bytes().startswith(b"\x89PNG")
    assert {"model.ply", "trajectory.txt", "report.html"} <= {path.name for path in out.iterdir()}


@pytest.mark.usefixtures("no_pictures")
def test_the_same_seed_gives_the_same_model(tmp_path):
    for name in "ab":
        assert run("demo", "-o", tmp_path / name, "--views", 1, "-q") == Run(0, "", "")
    assert (tmp_path / "a" / "model.ply").read_bytes() == (tmp_path / "b" / "model.ply").read_bytes()
    run("demo", "-o", tmp_path / "c", "--views", 1, "--seed", 1)
    assert (tmp_path / "a" / "model.ply").read_bytes() != (tmp_path / "c" / "model.ply").read_bytes()
