"""The command line: its files, its figures, its exit codes and what it says."""

import contextlib
import io
import json
import math
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.io.images import write_depth_png
from nacre.reconstruction import Reconstruction

pytest.importorskip("typer")


@dataclass(frozen=True)
class Run:
    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


def run(*arguments):
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as stopped,
    ):
        main([str(word) for word in arguments])
    return Run(stopped.value.code, out.getvalue(), err.getvalue())


def strict_json(path):
    return json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} in {path.name}"))


def fails(code, *arguments):
    """Run a command that must fail, and return its one line on stderr."""
    result = run(*arguments)
    assert result.code == code, result
    assert result.err.startswith("error: "), result.err
    assert result.err.count("\n") == 1, result.err
    assert "Traceback" not in result.err
    return result.err


SIMULATION = ("--views", 4, "--step", 12, "--noise", 0.0003, "--orthographic", "--pixel-size", 0.002)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a folder with a recording, and what ``simulate`` said."""
    folder = tmp_path_factory.mktemp("cli") / "recording"
    return folder, run("simulate", "built-in", "-o", folder, *SIMULATION)


@pytest.fixture(scope="module")
def recording(made):
    return made[0]


@pytest.fixture(scope="module")
def reconstructed(recording, tmp_path_factory):
    out = tmp_path_factory.mktemp("cli") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nacre.report.pictures._SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._MAIN_SIZE", (60, 60))
        return out, run("reconstruct", recording, "-o", out, "--json")


@pytest.fixture
def copied(recording, tmp_path):
    """Return a copy of the recording that a test may break."""
    return shutil.copytree(recording, tmp_path / "copied")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("cli") / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nacre.report.pictures._SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._MAIN_SIZE", (60, 60))
        patch.setattr("nacre.report.pictures._CAMERA_SIZE", (60, 45))
        return out, run("demo", "-o", out, "--views", 3, "--step", 15)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "object.ply"
    mesh = nacre.built_in_object()
    nacre.write_mesh(path, mesh.vertices, mesh.triangles)
    return path


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    mesh = nacre.built_in_object()
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(0.05), -math.sin(0.05)], [math.sin(0.05), math.cos(0.05)]]
    turn[:3, 3] = 0.002, -0.001, 0.003
    points = mesh.vertices[::7]
    target = points @ turn[:3, :3].T + turn[:3, 3]
    nacre.write_points(folder / "s.ply", points, attributes={"label": np.arange(len(points), dtype=np.int32)})
    nacre.write_points(folder / "t.ply", target)
    nacre.write_points(folder / "far.ply", points + 1000)
    return folder, turn


@pytest.fixture(scope="module")
def cloud(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "c.ply"
    random = np.random.default_rng(0)
    normals = random.normal(size=(3000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nacre.write_points(
        path,
        (0.1 * normals + random.normal(scale=0.001, size=normals.shape)).astype(np.float32),
        normals=normals.astype(np.float32),
        colors=random.integers(0, 256, normals.shape, dtype=np.uint8),
        attributes={"intensity": normals[:, 2].astype(np.float32)},
    )
    return path


@pytest.fixture
def no_pictures(monkeypatch):
    """Leave the pictures of the model out of the report: they take most of a short run's time."""
    monkeypatch.setattr("nacre.report.html.draw_model", lambda *_: None)


class TestProgram:
    def test_the_installed_entry_works(self):
        script = Path(sys.executable).with_name("nacre")  # in an environment that nacre is installed into
        program = (
            [script] if script.exists() else [sys.executable, "-c", "from nacre.cli import main; main()"]
        )
        done = subprocess.run([*program, "--version"], capture_output=True, text=True, check=True)
        assert done.stdout == f"nacre {nacre.__version__}\n"
        assert done.stderr == ""

    def test_help_names_every_command_and_each_has_an_example(self):
        text = run("--help").out
        for name in ("demo", "reconstruct", "simulate", "evaluate", "align", "consolidate", "info"):
            assert name in text
            result = run(name, "--help")
            assert result.code == 0
            assert f"Example: nacre {name}" in result.out

    def test_help_loads_no_heavy_module(self):
        code = (
            "import sys; from nacre.cli import main\n"
            "try: main(['--help'])\n"
            "except SystemExit: print([m for m in ('PIL', 'nacre.report', 'scipy') if m in sys.modules])"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.endswith("[]\n")

    def test_no_arguments_give_help(self):
        assert run().code == 0
        assert "reconstruct" in run().out

    def test_without_typer_one_line_says_what_to_install(self, tmp_path):
        (tmp_path / "typer.py").write_text(
            "raise ModuleNotFoundError(\"No module named 'typer'\", name='typer')"
        )
        code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from nacre.cli import main; main()"
        done = subprocess.run(
            [sys.executable, "-c", code, "demo"], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert done.stdout == ""
        assert done.stderr == 'error: the command line needs typer: pip install "nacre[cli]"\n'

    @pytest.mark.parametrize(
        "arguments", [["nothing"], ["info", "--nothing", "x"], ["demo", "--views", "0"], ["reconstruct", "x"]]
    )
    def test_wrong_usage_is_one_line_and_points_to_help(self, arguments):
        assert "--help)" in fails(2, *arguments)

    def test_unexpected_errors_have_a_traceback_only_on_demand(self, recording, monkeypatch):
        def broken(*arguments, **options):
            raise RuntimeError("broken")

        monkeypatch.setattr(nacre, "open_sequence", broken)
        assert "RuntimeError: broken" in fails(1, "info", recording)
        assert "Traceback" in run("info", recording, "-v", "-v").err

    def test_it_leaves_the_log_as_it_was(self, recording):
        import logging

        run("info", recording, "-q")
        logger = logging.getLogger("nacre")
        assert (logger.level, logger.propagate) == (logging.NOTSET, True)
        assert [type(handler) for handler in logger.handlers] == [logging.NullHandler]


class TestSimulate:
    def test_writes_a_recording_with_truth(self, made):
        folder, result = made
        assert result.code == 0
        assert f"nacre reconstruct {folder}" in result.out
        sequence = nacre.open_sequence(folder)
        assert len(sequence) == 4
        assert sequence.camera.model == "orthographic"
        assert sequence.camera.pixel_size == 0.002
        assert sequence.depth_scale == 50000
        mesh = nacre.built_in_object()
        expected = nacre.turntable_poses(mesh, 4, math.radians(12), camera=sequence.camera)
        np.testing.assert_allclose(sequence.truth.poses, expected, atol=1e-9)
        exact = mesh.simulate_depth(sequence.camera, expected[2])
        error = sequence[2].depth - exact
        assert 0.00025 < np.nanstd(error) < 0.00035

    def test_views_have_different_noise(self, tmp_path):
        run("simulate", "built-in", "-o", tmp_path / "r", *SIMULATION, "--step", 0, "--views", 2)
        first, second = (frame.depth for frame in nacre.open_sequence(tmp_path / "r"))
        assert np.nanstd(first - second) > 0.0003

    def test_pinhole_and_json(self, tmp_path):
        result = run(
            "simulate", "built-in", "-o", tmp_path / "r", "--views", 1, "--noise", "kinect", "--width", 160,
            "--height", 120, "--fx", 150, "--distance", 0.5, "--json",
        )  # fmt: skip
        assert result.json["views"] == 1
        camera = nacre.open_sequence(tmp_path / "r").camera
        assert (camera.model, camera.fx, camera.fy, camera.cx) == ("pinhole", 150, 150, 79.5)

    def test_a_mesh_in_millimetres_is_told_and_scaled(self, tmp_path):
        mesh = nacre.built_in_object()
        path = tmp_path / "mm.ply"
        nacre.write_mesh(path, 1000 * mesh.vertices, mesh.triangles)
        assert "--scale" in fails(2, "simulate", path, "-o", tmp_path / "r", *SIMULATION)
        assert not (tmp_path / "r").exists()
        assert run("simulate", path, "-o", tmp_path / "r", *SIMULATION, "--scale", 0.001).code == 0

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--noise", "foo"], "kinect"),
            (["--scale", "0"], "--scale"),
            (["--pixel-size", "0.001"], "--orthographic"),
            (["--orthographic", "--fx", "500"], "--fx"),
            (["--elevation", "100"], "elevation"),
        ],
    )
    def test_wrong_options(self, tmp_path, arguments, words):
        assert words in fails(2, "simulate", "built-in", "-o", tmp_path / "r", *arguments)

    def test_a_recording_is_not_overwritten(self, recording):
        assert "holds a recording already" in run("simulate", "built-in", "-o", recording).err

    def test_missing_and_broken_meshes(self, tmp_path):
        fails(2, "simulate", tmp_path / "no.ply", "-o", tmp_path / "r")
        fails(2, "simulate", tmp_path / "no.xyz", "-o", tmp_path / "r")
        (tmp_path / "broken.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\n")
        fails(1, "simulate", tmp_path / "broken.ply", "-o", tmp_path / "r")

    def test_nothing_in_view_is_told(self, tmp_path):
        error = run(
            "simulate", "built-in", "-o", tmp_path / "r", "--views", 1, "--cx", 5000, "--distance", 0.5
        )
        assert error.code == 1
        assert "no view shows anything" in error.err


@pytest.mark.usefixtures("no_pictures")
class TestReconstruct:
    def test_writes_every_file(self, reconstructed):
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

    def test_json_is_the_report_and_nothing_else(self, reconstructed):
        out, result = reconstructed
        assert result.json == strict_json(out / "report.json")
        assert result.err == ""

    def test_report_has_every_figure(self, reconstructed, recording):
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

    def test_trajectory_has_the_indices_as_times(self, reconstructed):
        out, _ = reconstructed
        trajectory = nacre.read_trajectory(out / "trajectory.txt")
        assert trajectory.timestamps.tolist() == [0, 1, 2, 3]
        np.testing.assert_allclose(trajectory.poses[0], np.eye(4), atol=1e-12)

    def test_frames_are_chosen_and_keep_their_indices(self, recording, tmp_path):
        result = run(
            "reconstruct", recording, "-o", tmp_path / "o", "--first", 1, "--last", 3, "--every", 2, "--json"
        )
        assert [frame["index"] for frame in result.json["frames"]] == [1, 3]
        assert nacre.read_trajectory(tmp_path / "o" / "trajectory.txt").timestamps.tolist() == [1, 3]

    def test_no_frames_left(self, recording, tmp_path):
        assert "0 to 3" in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--first", 4)

    def test_frames_that_cannot_be_read_are_lost_and_the_run_goes_on(self, copied, tmp_path):
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

    def test_every_frame_lost(self, copied, tmp_path):
        for path in (copied / "depth").iterdir():
            write_depth_png(path, np.zeros((112, 112), np.uint16))
        result = run("reconstruct", copied, "-o", tmp_path / "o")
        assert result.code == 1
        assert "every frame was lost" in result.err
        assert strict_json(tmp_path / "o" / "report.json")["num_tracked"] == 0
        assert len(nacre.read_points(tmp_path / "o" / "model.ply")) == 0
        assert (tmp_path / "o" / "report.html").exists()

    def test_wrong_depth_scale_names_the_option(self, recording, tmp_path):
        error = run("reconstruct", recording, "-o", tmp_path / "o", "--depth-scale", 1, "-q")
        assert error.code == 1
        assert "--depth-scale" in error.err
        assert error.err.count("\n") == 1

    def test_a_bad_depth_later_on_is_lost(self, copied, tmp_path):
        write_depth_png(copied / "depth" / "000002.png", np.full((112, 112), 3, np.uint16))
        report = run("reconstruct", copied, "-o", tmp_path / "o", "--json").json
        assert report["frames"][2]["status"] == "LOST"
        assert "median" in report["frames"][2]["reason"]

    def test_unwritable_out_fails_before_the_work(self, recording, tmp_path, monkeypatch):
        monkeypatch.setattr(Reconstruction, "run", lambda *_: pytest.fail("the work began"))
        (tmp_path / "file").write_text("x")
        assert "it is a file" in fails(2, "reconstruct", recording, "-o", tmp_path / "file")
        fails(2, "reconstruct", recording, "-o", tmp_path / "file" / "below")

    def test_interrupted_runs_write_what_there_is(self, recording, tmp_path, monkeypatch):
        whole = Reconstruction.run

        def interrupted(self, indices=None):
            for record in whole(self, indices):
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

    def test_quiet_says_nothing(self, recording, tmp_path):
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
    def test_no_recording(self, tmp_path, build, words):
        build(tmp_path / "source")
        assert words in fails(2, "reconstruct", tmp_path / "source", "-o", tmp_path / "o")

    def test_almost_a_tum_recording(self, recording, tmp_path):
        shutil.copytree(recording / "depth", tmp_path / "almost" / "depth")
        (tmp_path / "almost" / "rgb.txt").write_text("")
        error = fails(2, "reconstruct", tmp_path / "almost", "-o", tmp_path / "o")
        assert "almost a TUM recording: depth.txt is missing" in error

    def test_depth_images_alone_ask_for_options(self, recording, tmp_path):
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

    def test_missing_extra_names_the_command(self, recording, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "PIL", None)
        assert 'pip install "nacre[images]"' in fails(2, "reconstruct", recording, "-o", tmp_path / "o")


@pytest.mark.usefixtures("no_pictures")
class TestParameters:
    def reports(self, recording, tmp_path, *arguments):
        result = run("reconstruct", recording, "-o", tmp_path / "o", "--last", 0, "--json", *arguments)
        assert result.code == 0, result.err
        return result.json

    def test_set_wins_over_file_wins_over_preset(self, recording, tmp_path):
        config = tmp_path / "c.toml"
        config.write_text(
            'preset = "paper"\nspacing = 0.004\n[registration]\nmax_angle = 0.25\nmax_iterations = 7\n'
        )
        arguments = ("--config", config, "--set", "registration.max_angle=0.5", "--set", "fold_in=wlop+")
        report = self.reports(recording, tmp_path, *arguments)
        parameters, paper = report["parameters"], nacre.ModelParameters.preset("paper")
        assert report["preset"] == "paper"
        assert parameters["spacing"] == 0.004
        assert parameters["registration"]["max_angle"] == 0.5
        assert parameters["registration"]["max_iterations"] == 7
        assert parameters["registration"]["method"] == paper.registration.method
        assert parameters["fold_in"] == "wlop+"

    def test_depth_options_are_parameters(self, recording, tmp_path):
        depth = self.reports(recording, tmp_path, "--max-depth", 2, "--set", "depth.noise=0.001")[
            "parameters"
        ]["depth"]
        assert depth["max_depth"] == 2
        assert depth["noise"]["constant"] == 0.001

    @pytest.mark.parametrize(
        ("setting", "words"),
        [
            ("foo=1", "spacing"),
            ("registration.max_angel=1", "did you mean registration.max_angle"),
            ("spacing.foo=1", "spacing"),
            ("registration=1", "group"),
            ("registration.max_angle=wide", "a number"),
            ("registration.max_angle=-1", "max_angle must be"),
            ("registration.robust=1", "true or false"),
            ("registration.max_iterations=1.5", "a whole number"),
            ("registration.method=foo", "point_to_plane"),
            ("spacing", "KEY=VALUE"),
            ("spacing=", "KEY=VALUE"),
            ("spacing=[1", "TOML"),
        ],
    )
    def test_wrong_settings(self, recording, tmp_path, setting, words):
        assert words in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--set", setting)
        assert not (tmp_path / "o").exists()

    @pytest.mark.parametrize("text", ["x", "foo = 1", 'preset = "foo"', "[registration]\nfoo = 1"])
    def test_wrong_files(self, recording, tmp_path, text):
        (tmp_path / "c.toml").write_text(text)
        assert "c.toml" in fails(
            1, "reconstruct", recording, "-o", tmp_path / "o", "--config", tmp_path / "c.toml"
        )

    def test_missing_file(self, recording, tmp_path):
        fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--config", tmp_path / "c.toml")


class TestDemo:
    def test_tells_figures_and_files(self, demo):
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

    def test_writes_files_and_pictures(self, demo):
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
    def test_the_same_seed_gives_the_same_model(self, tmp_path):
        for name in "ab":
            assert run("demo", "-o", tmp_path / name, "--views", 1, "-q") == Run(0, "", "")
        assert (tmp_path / "a" / "model.ply").read_bytes() == (tmp_path / "b" / "model.ply").read_bytes()
        run("demo", "-o", tmp_path / "c", "--views", 1, "--seed", 1)
        assert (tmp_path / "a" / "model.ply").read_bytes() != (tmp_path / "c" / "model.ply").read_bytes()


class TestEvaluate:
    def test_model_against_mesh_through_the_true_poses(self, reconstructed, mesh):
        figures = run("evaluate", reconstructed[0], mesh, "--tau", 0.004, "--json").json
        assert figures["surface_accuracy"]["rms"] < 0.001
        assert figures["completeness"]["tau"] == [0.004]
        assert figures["normal_error"]["unoriented_mean"] < 0.3
        assert {"f_score", "uniformity"} <= set(figures)
        assert "true pose" in figures["world_from_model_from"]

    def test_pose_from_a_file_and_by_icp(self, reconstructed, recording, mesh, tmp_path):
        model, pose = reconstructed[0] / "model.ply", tmp_path / "pose.txt"
        unmoved = run("evaluate", model, mesh, "--json").json
        np.savetxt(pose, nacre.open_sequence(recording).truth.poses[0])
        moved = run("evaluate", model, mesh, "--world-from-model", pose, "--json").json
        aligned = run("evaluate", model, mesh, "--world-from-model", pose, "--align", "--json").json
        assert unmoved["surface_accuracy"]["rms"] > 0.05
        assert aligned["surface_accuracy"]["rms"] <= moved["surface_accuracy"]["rms"] * 1.05 < 0.001

    def test_model_against_points(self, reconstructed):
        model = reconstructed[0] / "model.ply"
        result = run("evaluate", model, model)
        assert result.code == 0
        assert "100 %" in result.out

    def test_no_first_guess_is_far_away(self, reconstructed, tmp_path):
        nacre.write_points(tmp_path / "far.ply", np.random.default_rng(0).normal(size=(500, 3)) + 1000)
        assert "--align" in fails(
            1, "evaluate", reconstructed[0] / "model.ply", tmp_path / "far.ply", "--align"
        )

    def test_trajectory_three_ways(self, reconstructed, recording):
        out, _ = reconstructed
        known = strict_json(out / "report.json")["absolute_trajectory_error"]
        for arguments in ([out], [out, recording], [out / "trajectory.txt", recording / "groundtruth.txt"]):
            figures = run("evaluate", *arguments, "--json").json
            assert figures["absolute_trajectory_error"]["rmse"] == pytest.approx(known["rmse"], rel=1e-6)
            assert figures["relative_pose_error"]["num_pairs"] == 3

    @pytest.mark.parametrize(
        "names", [["trajectory.txt"], ["model.ply"], ["missing"], ["report.html", "missing"]]
    )
    def test_wrong_usage(self, reconstructed, names):
        fails(2, "evaluate", *(reconstructed[0] / name for name in names))

    def test_folder_without_report(self, tmp_path):
        assert "report.json" in fails(2, "evaluate", tmp_path)
        (tmp_path / "report.json").write_text("{}")
        fails(1, "evaluate", tmp_path)

    def test_no_common_times(self, reconstructed, tmp_path):
        nacre.write_trajectory(tmp_path / "t.txt", [500.0], np.eye(4)[None])
        assert "--max-difference" in fails(
            1, "evaluate", reconstructed[0] / "trajectory.txt", tmp_path / "t.txt"
        )


class TestAlign:
    @pytest.mark.parametrize("method", ["symmetric", "point_to_plane", "point_to_point"])
    def test_finds_the_motion(self, clouds, tmp_path, method):
        folder, turn = clouds
        arguments = ("--method", method, "--max-iterations", 200)
        result = run(
            "align", folder / "s.ply", folder / "t.ply", "-o", tmp_path / "m.ply", "--json", *arguments
        )
        assert result.code == 0, result
        np.testing.assert_allclose(result.json["target_from_source"], turn, atol=2e-4)
        moved, target = nacre.read_points(tmp_path / "m.ply"), nacre.read_points(folder / "t.ply")
        np.testing.assert_allclose(moved.points, target.points, atol=1e-4)
        assert moved.attributes["label"].tolist() == list(range(len(target)))

    def test_starts_from_a_file(self, clouds, tmp_path):
        folder, turn = clouds
        np.savetxt(tmp_path / "g.txt", turn)
        result = run("align", folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "g.txt")
        assert result.code == 0
        assert "converged" in result.out
        (tmp_path / "bad.txt").write_text("1 2\n")
        fails(1, "align", folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "bad.txt")

    def test_nothing_matched_or_still_moving(self, clouds, tmp_path):
        folder, _ = clouds
        arguments = ("--json", "-o", tmp_path / "m.ply")
        result = run("align", folder / "s.ply", folder / "far.ply", "--max-distance", 0.1, *arguments)
        assert result.code == 1
        assert result.json["converged"] is False
        assert result.json["rmse"] is None
        assert not (tmp_path / "m.ply").exists()
        assert run("align", folder / "s.ply", folder / "t.ply", "--max-iterations", 1).code == 1

    def test_wrong_files(self, clouds, tmp_path):
        folder, _ = clouds
        fails(2, "align", folder / "s.ply", tmp_path / "no.ply")
        fails(2, "align", folder / "s.ply", folder / "t.ply", "-o", tmp_path / "no" / "m.ply")
        fails(2, "align", folder / "s.ply", folder / "t.ply", "--method", "foo")

    def test_without_a_first_guess(self, clouds, tmp_path):
        folder, turn = clouds
        out = tmp_path / "m.ply"
        result = run("align", folder / "s.ply", folder / "t.ply", "--global", "-o", out, "--json")
        assert result.json["status"] in ("found", "ambiguous", "not_found")
        assert result.code == (0 if result.json["status"] == "found" else 1)
        if result.json["found"]:
            np.testing.assert_allclose(result.json["target_from_source"], turn, atol=2e-3)
        assert out.exists()
        (tmp_path / "g.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
        arguments = (folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "g.txt", "--global")
        assert "--initial" in fails(2, "align", *arguments)
        assert "--global" in fails(2, "align", folder / "s.ply", folder / "t.ply", "--seen-from-origin")


class TestConsolidate:
    @pytest.mark.parametrize("suffix", [".ply", ".pcd"])
    def test_everything_is_carried_along(self, cloud, tmp_path, suffix):
        out = tmp_path / f"o{suffix}"
        result = run("consolidate", cloud, out, "--num-points", 400)
        assert result.code == 0, result.err
        assert "from the density" in result.out
        thin = nacre.read_points(out)
        assert len(thin) == 400
        assert thin.colors is not None
        unit = thin.points / np.linalg.norm(thin.points, axis=1, keepdims=True)
        assert np.einsum("ij,ij->i", unit, thin.normals).min() > 0.95
        np.testing.assert_allclose(thin.attributes["intensity"], unit[:, 2], atol=0.1)

    def test_options_are_those_of_the_function(self, cloud, tmp_path):
        out = tmp_path / "o.ply"
        options = {
            "radius": 0.03,
            "num_points": 300,
            "iterations": 4,
            "mu": 0.3,
            "method": "wlop+",
            "seed": 5,
        }
        words = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", value)]
        figures = run("consolidate", cloud, out, *words, "--json").json
        expected = nacre.consolidate(nacre.read_points(cloud).points, **options).points
        np.testing.assert_array_equal(nacre.read_points(out).points, expected)
        assert figures["radius"] == 0.03
        assert figures["radius_given"] is True

    def test_default_radius_follows_the_spacing(self, cloud, tmp_path):
        radii = [
            run(
                "consolidate", cloud, tmp_path / "o.ply", "--num-points", n, "--iterations", 0, "--json"
            ).json["radius"]
            for n in (200, 800)
        ]
        lattice = math.sqrt(4 * math.pi * 0.1**2 / 200)  # distance of 200 points on the sphere
        assert radii[0] == pytest.approx(2.5 * lattice, rel=0.2)
        assert radii[0] == pytest.approx(2 * radii[1], rel=0.01)

    def test_wrong_usage(self, cloud, tmp_path):
        fails(2, "consolidate", cloud, tmp_path / "o.xyz")
        fails(2, "consolidate", cloud, tmp_path / "no" / "o.ply")
        fails(2, "consolidate", tmp_path / "no.ply", tmp_path / "o.ply")
        fails(2, "consolidate", cloud, tmp_path / "o.ply", "--radius", "-1")
        nacre.write_points(tmp_path / "nan.ply", np.full((5, 3), np.nan))
        fails(1, "consolidate", tmp_path / "nan.ply", tmp_path / "o.ply")
        nacre.write_points(tmp_path / "same.ply", np.ones((50, 3)))
        assert "--radius" in fails(2, "consolidate", tmp_path / "same.ply", tmp_path / "o.ply")


class TestInfo:
    def test_recording(self, recording):
        figures = run("info", recording, "--json").json
        assert figures["kind"] == "recording"
        assert (figures["format"], figures["num_frames"], figures["depth_scale"]) == ("plain", 4, 50000)
        assert figures["truth"] is True
        assert figures["color"] is False
        assert 0.1 < figures["first_frame"]["median"] < 1
        text = run("info", recording).out
        assert re.search(r"true poses +yes, 4", text)

    def test_points_mesh_and_model(self, reconstructed, tmp_path):
        figures = run("info", reconstructed[0] / "model.ply", "--json").json
        assert figures["kind"] == "points"
        assert figures["fields"] == ["normals"]
        assert "confidence" in figures["attributes"]
        mesh = nacre.built_in_object()
        nacre.write_mesh(tmp_path / "m.ply", mesh.vertices, mesh.triangles)
        figures = run("info", tmp_path / "m.ply", "--json").json
        assert (figures["kind"], figures["num_triangles"]) == ("mesh", len(mesh.triangles))
        np.testing.assert_allclose([figures["lower"], figures["upper"]], mesh.bounds, atol=1e-6)

    def test_empty_and_nan_points(self, tmp_path):
        nacre.write_points(tmp_path / "n.ply", np.full((4, 3), np.nan))
        assert run("info", tmp_path / "n.ply", "--json").json["spacing"] is None
        nacre.write_points(tmp_path / "e.pcd", np.zeros((0, 3)))
        assert run("info", tmp_path / "e.pcd").code == 0
        nacre.write_points(tmp_path / "one.pcd", np.zeros((1, 3)))
        assert run("info", tmp_path / "one.pcd", "--json").json["num_points"] == 1

    def test_wrong_files(self, tmp_path):
        fails(2, "info", tmp_path / "no")
        (tmp_path / "x.txt").write_text("x")
        fails(2, "info", tmp_path / "x.txt")
        (tmp_path / "x.ply").write_text("x")
        fails(1, "info", tmp_path / "x.ply")


@pytest.mark.data
@pytest.mark.usefixtures("no_pictures")
class TestRealData:
    def test_tum(self, recordings, tmp_path):
        result = run("reconstruct", recordings / "tum-fr3-teddy", "-o", tmp_path / "o", "--last", 4, "--json")
        assert result.code == 0, result.err
        report = result.json
        assert report["num_tracked"] == 5
        assert report["absolute_trajectory_error"]["rmse"] < 0.01
        assert report["frames"][0]["timestamp"] > 1e9

    def test_redwood_with_and_without_colour(self, recordings, tmp_path):
        for name, options in (("color", ()), ("plain", ("--no-color",))):
            source = recordings / "redwood-livingroom1"
            assert run("reconstruct", source, "-o", tmp_path / name, "--last", 0, *options).code == 0
            cloud = nacre.read_points(tmp_path / name / "model.ply")
            assert (cloud.colors is not None) == (name == "color")

    def test_malformed_points_are_told(self, recordings):
        codes = [run("info", path).code for path in sorted((recordings / "malformed-ply").glob("*.ply"))]
        assert codes.count(0) == 2
        assert codes.count(1) == len(codes) - 2
