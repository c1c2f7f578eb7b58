"""``nacre consolidate``."""

import math

import numpy as np
import pytest
from command_line import fails, run

import nacre


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


@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_everything_is_carried_along(cloud, tmp_path, suffix):
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


def test_options_are_those_of_the_function(cloud, tmp_path):
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


def test_default_radius_follows_the_spacing(cloud, tmp_path):
    radii = [
        run("consolidate", cloud, tmp_path / "o.ply", "--num-points", n, "--iterations", 0, "--json").json[
            "radius"
        ]
        for n in (200, 800)
    ]
    lattice = math.sqrt(4 * math.pi * 0.1**2 / 200)  # distance of 200 points on the sphere
    assert radii[0] == pytest.approx(2.5 * lattice, rel=0.2)
    assert radii[0] == pytest.approx(2 * radii[1], rel=0.01)


def test_wrong_usage(cloud, tmp_path):
    fails(2, "consolidate", cloud, tmp_path / "o.obj")
    fails(2, "consolidate", cloud, tmp_path / "no" / "o.ply")
    fails(2, "consolidate", tmp_path / "no.ply", tmp_path / "o.ply")
    fails(2, "consolidate", cloud, tmp_path / "o.ply", "--radius", "-1")
    nacre.write_points(tmp_path / "nan.ply", np.full((5, 3), np.nan))
    fails(1, "consolidate", tmp_path / "nan.ply", tmp_path / "o.ply")
    nacre.write_points(tmp_path / "same.ply", np.ones((50, 3)))
    assert "--radius" in fails(2, "consolidate", tmp_path / "same.ply", tmp_path / "o.ply")
