"""Parameters of ``nacre reconstruct``, from options and files."""

import pytest
from command_line import fails, run

import nacre

pytestmark = pytest.mark.usefixtures("no_pictures")


def reports(recording, tmp_path, *arguments):
    result = run("reconstruct", recording, "-o", tmp_path / "o", "--last", 0, "--json", *arguments)
    assert result.code == 0, result.err
    return result.json


def test_set_wins_over_file_wins_over_preset(recording, tmp_path):
    config = tmp_path / "c.toml"
    config.write_text(
        'preset = "paper"\nspacing = 0.004\n[registration]\nmax_angle = 0.25\nmax_iterations = 7\n'
    )
    arguments = ("--config", config, "--set", "registration.max_angle=0.5", "--set", "fusion_method=wlop+")
    report = reports(recording, tmp_path, *arguments)
    parameters, paper = report["parameters"], nacre.ModelParameters.preset("paper")
    assert report["preset"] == "paper"
    assert parameters["spacing"] == 0.004
    assert parameters["registration"]["max_angle"] == 0.5
    assert parameters["registration"]["max_iterations"] == 7
    assert parameters["registration"]["method"] == paper.registration.method
    assert parameters["fusion_method"] == "wlop+"


def test_depth_options_are_parameters(recording, tmp_path):
    depth = reports(recording, tmp_path, "--max-depth", 2, "--set", "depth.noise=0.001")["parameters"][
        "depth"
    ]
    assert depth["max_depth"] == 2
    assert depth["noise"]["constant"] == 0.001


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--loop-closure"], "loop_closure (--loop-closure) must be off for a model that deforms, got on"),
        (["--calibrate"], "calibrate_depth (--calibrate) must be off for a model that deforms, got on"),
        (["--set", "loop_closure=true"], "loop_closure (--loop-closure) must be off"),
        (["--preset", "paper"], "fusion_method must be fuse for a model that deforms, got wlop"),
        (["--set", "fusion_method=wlop+"], "fusion_method must be fuse for a model that deforms, got wlop+"),
    ],
)
def test_what_bends_refuses_what_it_would_ignore(recording, tmp_path, arguments, message):
    assert message in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--deform", *arguments)
    assert not (tmp_path / "o").exists()


def test_what_bends_may_be_asked_to_leave_out_what_it_does_without(recording, tmp_path):
    config = tmp_path / "c.toml"
    config.write_text("loop_closure = true\n")
    assert "--loop-closure" in fails(
        2, "reconstruct", recording, "-o", tmp_path / "o", "--deform", "--config", config
    )
    report = reports(recording, tmp_path, "--deform", "--config", config, "--no-loop-closure")
    assert report["parameters"]["deform"] is True


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
def test_wrong_settings(recording, tmp_path, setting, words):
    assert words in fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--set", setting)
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("text", ["x", "foo = 1", 'preset = "foo"', "[registration]\nfoo = 1"])
def test_wrong_files(recording, tmp_path, text):
    (tmp_path / "c.toml").write_text(text)
    assert "c.toml" in fails(
        1, "reconstruct", recording, "-o", tmp_path / "o", "--config", tmp_path / "c.toml"
    )


def test_missing_file(recording, tmp_path):
    fails(2, "reconstruct", recording, "-o", tmp_path / "o", "--config", tmp_path / "c.toml")
