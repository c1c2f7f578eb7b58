"""Whole files that hold what nobody measures: each command gives a result or one line of error."""

import warnings

import numpy as np
import pytest
from command_line import run

import nacre

BALL = np.random.default_rng(0).normal(size=(60, 3))
BALL /= np.linalg.norm(BALL, axis=1, keepdims=True)
POINTS = {
    "1e300 m": 1e300 * BALL,
    "1e38 m": 1e38 * BALL,
    "1e-300 m": 1e-300 * BALL,
    "none": BALL[:0],
    "one": BALL[:1],
    "two": BALL[:2],
    "one place": np.repeat(BALL[:1], 60, axis=0),
    "a line": BALL * (1, 0, 0),
    "a plane": BALL * (1, 1, 0),
    "1e12 m away": BALL + 1e12,
    "one at 1e30 m": np.vstack([BALL, [(1e30, 0, 0)]]),
    "all scales": BALL * np.logspace(-200, 200, 60)[:, None],
}
POSITIONS = {"0 m": 0.0, "1e30 m": 1e30, "1e-320 m": 1e-320, "1e160 m": 1e160}


def tried(*words):
    """Run a command without a warning; return its exit code, what it printed, and what it said."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(*words)
    assert result.code in (0, 1, 2)
    assert "should not happen" not in result.err
    assert "Traceback" not in result.err
    assert "nan" not in result.out.split()
    return result


@pytest.fixture
def ball(tmp_path):
    nacre.write_points(tmp_path / "ball.ply", BALL)
    return tmp_path / "ball.ply"


@pytest.mark.parametrize("name", POINTS)
def test_points(ball, tmp_path, name):
    path = tmp_path / "a.ply"
    nacre.write_points(path, POINTS[name])
    tried("info", path)
    tried("consolidate", path, tmp_path / "o.ply")
    tried("mesh", path, "-o", tmp_path / "m.ply")
    tried("align", path, ball)
    tried("align", ball, path)


@pytest.mark.parametrize("name", POINTS)
def test_meshes(ball, tmp_path, name):
    path = tmp_path / "a.obj"
    points = POINTS[name]
    lines = ["v {!r} {!r} {!r}\n".format(*point) for point in points.tolist()]
    lines += [f"f {i + 1} {i + 2} {i + 3}\n" for i in range(0, len(points) - 2, 3)]
    path.write_text("".join(lines))
    tried("info", path)
    tried("evaluate", ball, path)
    tried("simulate", path, "-o", tmp_path / "views", "--views", 2)


@pytest.mark.parametrize("name", POSITIONS)
@pytest.mark.parametrize("true_name", POSITIONS)
def test_trajectories(tmp_path, name, true_name):
    for file, what in (("a.txt", name), ("truth.txt", true_name)):
        lines = [f"{i} {0.1 * i} {POSITIONS[what] if i == 2 else 0} 0 0 0 0 1\n" for i in range(8)]
        (tmp_path / file).write_text("".join(lines))
    result = tried("evaluate", tmp_path / "a.txt", tmp_path / "truth.txt")
    assert (result.code == 1) == ("1e160 m" in (name, true_name))


def test_points_too_far_apart_say_so(tmp_path):
    nacre.write_points(tmp_path / "a.ply", 1e300 * BALL)
    assert "too far from each other" in tried("consolidate", tmp_path / "a.ply", tmp_path / "o.ply").err
    assert "too wide to be measured" in tried("info", tmp_path / "a.ply").out
