"""``nacre reconstruct``: its files, its figures and its exit codes."""

import shutil
import signal
import sys

import numpy as np
import pytest
from command_line import Run, fails, run, strict_json

import nacre
from nacre.io.images import write_depth_png
from nacre.reconstruction import Reconstruction

pytestmark = pytest.mark.usefixtures("no_pictures")


def test_writes_every_file(reconstructed):
    out, result = reconstructed
    assert result.code == 0, result.err
    assert sorted(path.name for path in out.iterdir()) == [
        "model.ply", "report.html", "report.json", "trajectory.txt",
    ]  # fmt: skip
    cloud = nacre.read_points(out / "model.ply")
    report = strict_json(out / "report.json")
    assert len(cloud) == report["num_points"] > 100
    assert cloud.normals is not None
    assert cloud.attributes["confidence"].shape == (len(cloud),)
    assert "<html" in (out / "report.html").read_text()


def test_all_points_may_be_written(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "nacre.meshing.surface_points.on_surface", lambda points, *_: points[:, 0] > points[:, 0].mean()
    )
    run("reconstruct", recording, "-o", tmp_path / "surface", "--last", "1")
    run("reconstruct", recording, "-o", tmp_path / "all", "--last", "1", "--all-points")
    surface, everything = (nacre.read_points(tmp_path / name / "model.ply") for name in ("surface", "all"))
    kept = everything.points[:, 0] > everything.points[:, 0].mean()
    assert np.array_equal(surface.points, everything.points[kept])
    assert np.array_equal(surface.attributes["confidence"], everything.attributes["confidence"][kept])
    assert strict_json(tmp_path / "all" / "report.json")["num_points"] == len(everything)
    assert strict_json(tmp_path / "surface" / "report.json")["num_points"] == len(surface)


def test_json_is_the_report_and_nothing_else(reconstructed):
    out, result = reconstructed
    assert result.json == strict_json(out / "report.json")
    assert result.err == ""


def test_report_has_every_figure(reconstructed, recording):
    report = strict_json(reconstructed[0] / "report.json")
    assert report["nacre"] == nacre.__version__
    assert report["recording"]["path"] == str(recording)
    assert report["parameters"]["registration"]["method"] == "symmetric"
    assert report["absolute_trajectory_error"]["rmse"] < 0.002
    assert report["relative_pose_error"]["num_pairs"] == 3
    assert [frame["index"] for frame in report["frames"]] == [0, 1, 2, 3]
    for frame in report["frames"]:
        assert frame["status"] == "TRACKED"
        assert np.array(frame["world_from_camera"]).shape == (4, 4)
        assert frame["milliseconds"]["total"] > 0
        assert frame["translation_error"] < 0.002
        assert frame["removed"]["edge"] > 0
        assert {"overlap", "rmse", "num_inliers", "num_points", "reason", "timestamp"} <= set(frame)


def test_trajectory_has_the_indices_as_times(reconstructed):
    out, _ = reconstructed
    trajectory = nacre.read_trajectory(out / "trajectory.txt")
    assert trajectory.timestamps.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(trajectory.poses[0], np.eye(4), atol=1e-12)


def test_frames_are_chosen_and_keep_their_indices(recording, tmp_path):
    result = run(
        "reconstruct", recording, "-o", tmp_path / "o", "--first", 1, "--last", 3, "--every", 2, "--json"
    )
    assert [frame["index"] for frame in result.json["frames"]] == [1, 3]
    assert nacre.read_trajectory(tmp_path / "o" / "trajectory.txt").timestamps.tolist() == [1, 3]


def test_no_frames_left(recording, tmp_path):
    assert "0 to 3" in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--first", 4)


def test_frames_that_cannot_be_read_are_lost_and_the_run_goes_on(copied, tmp_path):
    (copied / "depth" / "000001.png").write_bytes(b"\x89PNG\r\n\x1a\nshort")
    write_depth_png(copied / "depth" / "000002.png", np.full((7, 9), 1000, np.uint16))
    result = run("reconstruct", copied, "-o", tmp_path / "o", "--json")
    assert result.code == 0
    report = result.json
    assert [frame["status"] for frame in report["frames"]] == ["TRACKED", "LOST", "LOST", "TRACKED"]
    assert "000001.png" in report["frames"][1]["reason"]
    assert "9 wide and 7 high" in report["frames"][2]["reason"]
    assert report["frames"][1]["world_from_camera"] is None
    assert report["num_lost"] == 2
    assert report["coverage"] == 0.5
    assert nacre.read_trajectory(tmp_path / "o" / "trajectory.txt").timestamps.tolist() == [0, 3]
    assert "LOST" in (tmp_path / "o" / "report.html").read_text()


def test_every_frame_lost(copied, tmp_path):
    for path in (copied / "depth").iterdir():
        write_depth_png(path, np.zeros((112, 112), np.uint16))
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "trajectory.txt").write_text("0 0 0 0 0 0 0 1\n")  # of an earlier run
    result = run("reconstruct", copied, "-o", tmp_path / "o")
    assert result.code == 3
    assert not (tmp_path / "o" / "trajectory.txt").exists()
    assert "trajectory.txt" not in result.out
    assert "every frame was lost: no usable pixel" in result.err
    assert strict_json(tmp_path / "o" / "report.json")["num_tracked"] == 0
    assert len(nacre.read_points(tmp_path / "o" / "model.ply")) == 0
    assert (tmp_path / "o" / "report.html").exists()


def test_wrong_depth_scale_names_the_option(recording, tmp_path):
    error = run("reconstruct", recording, "-o", tmp_path / "o", "--depth-scale", 1, "-q")
    assert error.code == 1
    assert "--depth-scale" in error.err
    assert error.err.count("\n") == 1


def test_a_bad_depth_later_on_is_lost(copied, tmp_path):
    write_depth_png(copied / "depth" / "000002.png", np.full((112, 112), 3, np.uint16))
    report = run("reconstruct", copied, "-o", tmp_path / "o", "--json").json
    assert report["frames"][2]["status"] == "LOST"
    assert "median" in report["frames"][2]["reason"]


def test_unwritable_out_fails_before_the_work(recording, tmp_path, monkeypatch):
    monkeypatch.setattr(Reconstruction, "run", lambda *_: pytest.fail("the work began"))
    (tmp_path / "file").write_text("x")
    assert "it is a file" in fails(2, "reconstruct", recording, "-o", tmp_path / "file")
    fails(2, "reconstruct", recording, "-o", tmp_path / "file" / "below")


def test_interrupted_runs_write_what_there_is(recording, tmp_path, monkeypatch):
    whole = Reconstruction.run

    def interrupted(self, *given, **named):
        for record in whole(self, *given, **named):
            if record.index == 1:
                signal.raise_signal(signal.SIGINT)
            yield record

    monkeypatch.setattr(Reconstruction, "run", interrupted)
    result = run("reconstruct", recording, "-o", tmp_path / "o")
    assert result.code == 130
    assert "2 of 4 frames" in result.out
    report = strict_json(tmp_path / "o" / "report.json")
    assert report["interrupted"] is True
    assert len(report["frames"]) == 2
    assert len(nacre.read_points(tmp_path / "o" / "model.ply")) > 0


def test_quiet_says_nothing(recording, tmp_path):
    assert run("reconstruct", recording, "-o", tmp_path / "o", "-q", "--last", 0) == Run(0, "", "")


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda path: None, "no such recording"),
        (lambda path: path.mkdir(), "empty"),
        (
            lambda path: shutil.rmtree(path / "x", ignore_errors=True) or path.write_text("x"),
            "not a recording",
        ),
    ],
)
def test_no_recording(tmp_path, build, words):
    build(tmp_path / "source")
    assert words in fails(2, "reconstruct", tmp_path / "source", "-o", tmp_path / "o")


def test_almost_a_tum_recording(recording, tmp_path):
    shutil.copytree(recording / "depth", tmp_path / "almost" / "depth")
    (tmp_path / "almost" / "rgb.txt").write_text("")
    error = fails(2, "reconstruct", tmp_path / "almost", "-o", tmp_path / "o")
    assert "almost a TUM recording: depth.txt is missing" in error


def test_depth_images_alone_ask_for_options(recording, tmp_path):
    error = fails(2, "reconstruct", recording / "depth", "-o", tmp_path / "o")
    assert "--camera" in error
    assert "--depth-scale" in error
    result = run(
        "reconstruct",
        recording / "depth",
        "-o",
        tmp_path / "o",
        "--camera",
        recording / "camera.json",
        "--json",
    )
    assert result.json["num_tracked"] == 4
    assert "absolute_trajectory_error" not in result.json


def test_missing_extra_names_the_command(recording, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert 'pip install "nacre[images]"' in fails(2, "reconstruct", recording, "-o", tmp_path / "o")


@pytest.mark.data
def test_tum(recordings, tmp_path):
    result = run("reconstruct", recordings / "tum-fr3-teddy", "-o", tmp_path / "o", "--last", 11, "--json")
    assert result.code == 0, result.err
    report = result.json
    assert report["num_tracked"] == 12
    assert report["absolute_trajectory_error"]["num_compared"] >= 3
    assert report["absolute_trajectory_error"]["rmse"] < 0.01
    assert report["frames"][0]["timestamp"] > 1e9


@pytest.mark.data
def test_redwood_with_and_without_colour(recordings, tmp_path):
    for name, options in (("color", ()), ("plain", ("--no-color",))):
        source = recordings / "redwood-livingroom1"
        assert run("reconstruct", source, "-o", tmp_path / name, "--last", 0, *options).code == 0
        cloud = nacre.read_points(tmp_path / name / "model.ply")
        assert (cloud.colors is not None) == (name == "color")


@pytest.fixture(scope="module")
def mostly_blank(recording, tmp_path_factory):
    """A recording of which one frame of four holds a measurement."""
    copy = tmp_path_factory.mktemp("blank") / "recording"
    shutil.copytree(recording, copy)
    for index in (1, 2, 3):
        write_depth_png(copy / "depth" / f"{index:06d}.png", np.zeros((112, 112), np.uint16))
    return copy


@pytest.mark.parametrize(
    ("least", "code"), [((), 3), (("--min-tracked", 0.25), 0), (("--min-tracked", 0), 0)]
)
def test_too_few_tracked_frames_exit_with_3_and_all_is_written(mostly_blank, tmp_path, least, code):
    result = run("reconstruct", mostly_blank, "-o", tmp_path / "o", *least)
    assert result.code == code
    report = strict_json(tmp_path / "o" / "report.json")
    assert report["num_tracked"] == 1
    assert (report["verdict"]["level"] == "lost") == (code == 3)
    assert "not known: 1 of 4 frames have a pose and a true one" in result.out
    assert (tmp_path / "o" / "report.html").exists()
    assert len(nacre.read_points(tmp_path / "o" / "model.ply")) == report["num_points"] > 0
    assert (code == 3) == ("only 1 of 4 frames were tracked, less than 0.5 of them" in result.err)


@pytest.mark.parametrize("value", ["-0.1", "1.5", "nan", "half"])
def test_illegal_parts_are_refused_before_the_work(recording, tmp_path, value):
    assert "--min-tracked" in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--min-tracked", value)
    assert not (tmp_path / "o").exists()


def test_without_report_no_page_is_written_or_left(recording, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)  # what only the page needs
    (tmp_path / "o").mkdir()
    (tmp_path / "o" / "report.html").write_text("of an earlier model")
    (tmp_path / "o" / "notes.txt").write_text("mine")
    result = run("reconstruct", recording, "-o", tmp_path / "o", "--no-report")
    assert result.code == 0, result.err
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == [
        "model.ply", "notes.txt", "report.json", "trajectory.txt",
    ]  # fmt: skip
    assert "report.html" not in result.out
    assert strict_json(tmp_path / "o" / "report.json")["verdict"]["level"] == "ok"


def test_the_terminal_tells_the_verdict_and_the_accuracy(reconstructed, recording, tmp_path):
    report = strict_json(reconstructed[0] / "report.json")
    result = run("reconstruct", recording, "-o", tmp_path / "o", "--no-report")
    assert report["verdict"]["sentence"] in result.out
    assert "standard deviation expected from noise alone" in result.out
    assert report["doubled_surfaces"]["fraction"] == 0
    assert 0 < report["point_sigma"]["median"] <= report["point_sigma"]["p95"] < 0.001
