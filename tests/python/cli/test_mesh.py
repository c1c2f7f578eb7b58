"""``nacre mesh``: the ending of the file chooses the format."""

from contextlib import contextmanager

import numpy as np
import pytest
from command_line import fails, run

import nacre
from nacre.cli.terminal import Terminal
from nacre.io.meshes import WRITE_SUFFIXES, read_mesh_arrays


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    """Return a point file of a bent sheet, with normals and colours."""
    x, y = np.meshgrid(np.linspace(0, 1, 12), np.linspace(0, 1, 12))
    points = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x).ravel()])
    normals = np.tile([0.0, 0.0, 1.0], (144, 1))
    colors = np.random.default_rng(1).integers(0, 256, (144, 3)).astype(np.uint8)
    path = tmp_path_factory.mktemp("mesh") / "sheet.ply"
    nacre.write_points(path, points, normals=normals, colors=colors)
    return path


@pytest.fixture(scope="module")
def bowl(tmp_path_factory):
    """Return points of a sphere of 10 cm of which nothing was seen above 7 cm, with normals and colours."""
    i = np.arange(2000) + 0.5
    z, angle = 1 - i / 1000, np.pi * (1 + 5**0.5) * i
    ring = np.sqrt(1 - z * z)
    normals = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)[z < 0.7]
    path = tmp_path_factory.mktemp("mesh") / "bowl.ply"
    colors = np.tile(np.array([200, 10, 10], np.uint8), (len(normals), 1))
    nacre.write_points(path, 0.1 * normals, normals=normals, colors=colors)
    return path


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_the_ending_chooses_the_format(sheet, tmp_path, suffix):
    told = run("mesh", sheet, "-o", tmp_path / f"a{suffix}", "--json").json
    found = read_mesh_arrays(tmp_path / f"a{suffix}")
    assert (len(found.vertices), len(found.triangles)) == (told["vertices"], told["triangles"]) == (144, 242)
    assert (found.colors is None) == (found.normals is None) == (suffix == ".stl")


def test_an_ending_that_no_mesh_has(sheet, tmp_path):
    message = fails(2, "mesh", sheet, "-o", tmp_path / "a.usd")
    assert "meshes are written to .ply, .glb, .obj, .stl, got" in message
    assert not list(tmp_path.iterdir())


def test_a_mesh_is_simplified_as_it_is(sheet, tmp_path):
    run("mesh", sheet, "-o", tmp_path / "a.ply")
    told = run("mesh", tmp_path / "a.ply", "--simplify", 100, "-o", tmp_path / "b.ply", "--json").json
    assert told["triangles"] == 100
    assert set(map(tuple, read_mesh_arrays(tmp_path / "b.ply").colors)) <= set(
        map(tuple, nacre.read_points(sheet).colors)
    )


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_a_mesh_keeps_its_comments(tmp_path, suffix):
    source = tmp_path / f"a{suffix}"
    nacre.write_mesh(source, np.eye(3), [[0, 1, 2]], comments=["mine"])
    run("mesh", source, "-o", tmp_path / "b.ply")
    run("convert", source, tmp_path / "c.obj")
    run("mesh", source, "-o", tmp_path / "d.stl")
    for name in ("b.ply", "c.obj", "d.stl"):
        assert read_mesh_arrays(tmp_path / name).comments == ("mine",)


def test_what_a_format_has_no_place_for_is_told(sheet, tmp_path):
    said = run("mesh", sheet, "-o", tmp_path / "a.stl").err
    assert said == f"warning: {tmp_path / 'a.stl'}: .stl files have no place for colors\n"
    assert run("mesh", sheet, "-o", tmp_path / "a.stl", "--quiet").err == ""
    run("mesh", sheet, "-o", tmp_path / "a.ply")
    for suffix, kept in ((".stl", []), (".obj", ["normals", "colors"])):
        told = run("convert", tmp_path / "a.ply", tmp_path / f"b{suffix}", "--json")
        assert told.json["fields"] == kept
        assert ("no place for colors" in told.err) == (not kept)


def read_by_trimesh(path):
    """Return a mesh's vertices and, for each, how bright it is, as another program reads them."""
    trimesh = pytest.importorskip("trimesh")
    found = trimesh.load(path, process=False, force="mesh", skip_materials=True)
    return found.vertices, found.visual.vertex_colors[:, :3].astype(int).sum(axis=1)


@pytest.mark.parametrize("suffix", [".ply", ".glb", ".obj"])
def test_a_guess_is_darker_where_there_are_no_colors(bowl, tmp_path, suffix):
    pytest.importorskip("gpytoolbox")
    cloud = nacre.read_points(bowl)
    nacre.write_points(tmp_path / "model.ply", cloud.points, normals=cloud.normals)
    done = run("mesh", tmp_path / "model.ply", "--closed", "-o", tmp_path / f"a{suffix}", "--json")
    assert 0.7 < done.json["seen"] < 0.95
    assert done.err == "", "the colours have it, whether or not the format has a place for more"
    vertices, brightness = read_by_trimesh(tmp_path / f"a{suffix}")
    dark, light = np.unique(brightness)
    assert dark < 0.7 * light
    assert vertices[brightness == dark, 2].min() > 0.068
    assert vertices[brightness == light, 2].max() < 0.085  # two spacings beyond the rim


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_a_guess_is_grey_where_there_are_colors(bowl, tmp_path, suffix):
    pytest.importorskip("gpytoolbox")
    run("mesh", bowl, "--closed", "-o", tmp_path / "a.ply")
    for source, options in ((bowl, ["--closed"]), (tmp_path / "a.ply", [])):
        assert run("mesh", source, *options, "-o", tmp_path / f"b{suffix}").err == ""
        exact, found = (read_mesh_arrays(tmp_path / name) for name in ("a.ply", f"b{suffix}"))
        assert np.array_equal(found.colors, exact.colors)
        assert (found.colors[exact.attributes["seen"] == 0] == 128).all()


def test_a_guess_that_a_format_cannot_mark_is_told_once(bowl, tmp_path):
    pytest.importorskip("gpytoolbox")
    said = run("mesh", bowl, "--closed", "-o", tmp_path / "a.stl").err
    assert said == f"warning: {tmp_path / 'a.stl'}: .stl files have no place for seen and colors\n"


def test_its_steps_are_told(sheet, bowl, tmp_path, monkeypatch):
    told = []

    @contextmanager
    def progress(self, description, total):
        told.append(total)
        yield told.append

    monkeypatch.setattr(Terminal, "progress", progress)
    run("mesh", sheet, "-o", tmp_path / "a.ply", "--keep", "largest", "--simplify", "50")
    assert told == [5, "reading", "laying triangles", "choosing parts", "simplifying", "writing"]
    told.clear()
    run("mesh", tmp_path / "a.ply", "-o", tmp_path / "b.stl")
    assert told == [2, "reading", "writing"], "a mesh has its triangles"
    pytest.importorskip("gpytoolbox")
    told.clear()
    run("mesh", bowl, "-o", tmp_path / "a.ply", "--closed")
    assert told == [3, "reading", "closing the surface", "writing"]
