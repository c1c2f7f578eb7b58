"""Meshes that nacre writes, as they are read again and as another program (trimesh) sees them."""

import dataclasses
import json
import struct
import sys
import warnings

import numpy as np
import pytest

import nacre
from nacre.io.meshes import READ_SUFFIXES, WRITE_SUFFIXES, read_mesh_arrays
from nacre.meshing import Texture

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.75]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
NORMALS = np.array([[0, 0, 1], [1, 0, 0], [0, 0.6, 0.8], [0, 0, -1]])
COLORS = np.array([[255, 0, 0], [1, 2, 3], [0, 128, 127], [250, 251, 252]], np.uint8)
COLORED = [".glb", ".obj", ".ply"]


def write(path, vertices=TETRAHEDRON, **options):
    nacre.write_mesh(path, vertices, TRIANGLES, **options)
    return path


def seen_by_trimesh(path):
    trimesh = pytest.importorskip("trimesh")
    loaded = trimesh.load(path, process=False)
    if not isinstance(loaded, trimesh.Scene):
        return loaded
    (node,) = loaded.graph.nodes_geometry
    place, name = loaded.graph[node]
    return loaded.geometry[name].apply_transform(place)


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_another_program_sees_the_same_surface(tmp_path, suffix):
    fields = {} if suffix == ".stl" else {"normals": NORMALS, "colors": COLORS}
    seen = seen_by_trimesh(write(tmp_path / f"a{suffix}", **fields))
    assert seen.area == pytest.approx(np.linalg.norm(_doubled_normals(), axis=1).sum() / 2)
    np.testing.assert_allclose(seen.triangles, TETRAHEDRON[TRIANGLES], rtol=1e-6)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_another_program_sees_normals_and_colours(tmp_path, suffix):
    seen = seen_by_trimesh(write(tmp_path / f"a{suffix}", normals=NORMALS, colors=COLORS))
    np.testing.assert_allclose(seen.vertex_normals, NORMALS, atol=1e-6)
    np.testing.assert_array_equal(seen.visual.vertex_colors[:, :3], COLORS)


def test_colours_of_glb_are_linear_light(tmp_path):
    """The format has it so: what is half as bright in linear light is 188 of 255 on a screen."""
    path = write(tmp_path / "a.glb", colors=np.full((4, 3), 188, np.uint8), normals=NORMALS)
    seen = seen_by_trimesh(path)
    np.testing.assert_allclose(seen.visual.vertex_attributes["color"], 0.5, atol=0.003)
    np.testing.assert_allclose(seen.vertex_normals, NORMALS, atol=1e-6)
    assert seen.visual.material.doubleSided
    trimesh = pytest.importorskip("trimesh")
    bare = trimesh.load(path, process=False, skip_materials=True).to_geometry()
    np.testing.assert_array_equal(bare.visual.vertex_colors, [[128, 128, 128, 255]] * 4)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("suffix", sorted(set(COLORED) & set(READ_SUFFIXES)))
def test_what_is_written_is_read_again(tmp_path, suffix, dtype):
    vertices = TETRAHEDRON.astype(dtype) / (4 if suffix == ".glb" else 3)
    found = read_mesh_arrays(write(tmp_path / f"a{suffix}", vertices, normals=NORMALS, colors=COLORS))
    np.testing.assert_array_equal(found.vertices.astype(dtype), vertices)
    np.testing.assert_array_equal(found.triangles, TRIANGLES)
    np.testing.assert_allclose(found.normals, NORMALS, atol=1e-7 if suffix == ".glb" else 0)
    np.testing.assert_array_equal(found.colors, COLORS)
    bare = read_mesh_arrays(write(tmp_path / f"b{suffix}", vertices))
    assert (bare.normals, bare.colors) == (None, None)


@pytest.mark.parametrize("suffix", COLORED)
def test_a_mesh_keeps_its_normals_and_colours(tmp_path, suffix):
    mesh = nacre.Mesh(TETRAHEDRON, TRIANGLES, normals=NORMALS, colors=COLORS)
    nacre.write_mesh(tmp_path / f"a{suffix}", mesh)
    found = nacre.read_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_allclose(found.normals, NORMALS, atol=1e-7)
    np.testing.assert_array_equal(found.colors, COLORS)
    nacre.write_mesh(tmp_path / f"b{suffix}", mesh, colors=COLORS[::-1])
    np.testing.assert_array_equal(nacre.read_mesh(tmp_path / f"b{suffix}").colors, COLORS[::-1])


@pytest.mark.parametrize(
    ("suffix", "lost"),
    [(".ply", None), (".glb", "heat"), (".obj", "heat"), (".stl", "heat and colors")],
)
def test_what_a_format_has_no_place_for_is_warned_of(tmp_path, suffix, lost):
    mesh = nacre.Mesh(TETRAHEDRON, TRIANGLES, normals=NORMALS, colors=COLORS)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        nacre.write_mesh(tmp_path / f"a{suffix}", mesh, attributes={"heat": np.arange(4.0)})
    assert [warning.filename for warning in told] == [__file__] * (lost is not None)
    assert all(f"{suffix} files have no place for {lost}" in str(warning.message) for warning in told)


def test_normals_of_an_stl_file_are_those_of_its_triangles_without_a_word(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write(tmp_path / "a.stl", normals=NORMALS)


@pytest.mark.parametrize("binary", [True, False])
def test_facets_of_stl_have_the_normals_of_their_corners(tmp_path, binary):
    path = write(tmp_path / "a.stl", binary=binary)
    expected = _doubled_normals() / np.linalg.norm(_doubled_normals(), axis=1, keepdims=True)
    np.testing.assert_allclose(seen_by_trimesh(path).face_normals, expected, atol=1e-6)
    again = read_mesh_arrays(path)
    np.testing.assert_array_equal(again.vertices[again.triangles], TETRAHEDRON[TRIANGLES].astype(np.float32))
    assert (b"facet normal" in path.read_bytes()) != binary


@pytest.mark.parametrize("binary", [True, False])
def test_stl_is_written_in_blocks_of_facets(tmp_path, monkeypatch, binary):
    whole = write(tmp_path / "a.stl", binary=binary).read_bytes()
    monkeypatch.setattr("nacre.io.stl._FACETS_AT_ONCE", 3)
    assert write(tmp_path / "a.stl", binary=binary).read_bytes() == whole


def test_a_facet_without_area_has_no_normal(tmp_path):
    nacre.write_mesh(tmp_path / "a.stl", TETRAHEDRON, [[0, 1, 1]])
    assert np.frombuffer((tmp_path / "a.stl").read_bytes(), "<f4", 3, 84).tolist() == [0, 0, 0]


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_georeferenced_vertices_keep_a_tenth_of_a_millimetre(tmp_path, suffix):
    vertices = TETRAHEDRON / 3 + (4_500_000.1234, 5_300_000.9876, 321.4321)
    seen = seen_by_trimesh(write(tmp_path / f"a{suffix}", vertices))
    np.testing.assert_allclose(seen.vertices, vertices, rtol=0, atol=1e-4 if suffix != ".ply" else 0)


def test_normals_of_glb_are_unit_vectors(tmp_path):
    path = write(tmp_path / "a.glb", normals=[[0, 0, 9], [0, 0, 0], [np.nan, 0, 0], [0.1, 0, 0]])
    document, binary = _chunks(path)
    (accessor,) = (document["accessors"][p["attributes"]["NORMAL"]] for p in _primitives(document))
    view = document["bufferViews"][accessor["bufferView"]]
    normals = np.frombuffer(binary, "<f4", 12, view["byteOffset"]).reshape(4, 3)
    assert normals.tolist() == [[0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]]


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_comments_are_read_again(tmp_path, suffix):
    assert read_mesh_arrays(write(tmp_path / f"a{suffix}")).comments == ()
    comments = ("made by hand", "", "café")
    assert read_mesh_arrays(write(tmp_path / f"a{suffix}", comments=comments)).comments == comments


def test_stl_has_place_for_comments_of_69_bytes(tmp_path):
    for comments, kept in (
        (["a" * 69], ["a" * 69]),
        (["a" * 70], []),
        (["first", "a" * 60, "é" * 30, "last"], ["first", "a" * 60]),
        (["first", "é" * 30, "a" * 60, "last"], ["first", "é" * 30]),
        (["a" * 80, "solid"], ["solid"]),
    ):
        path = write(tmp_path / "a.stl", comments=comments)
        data = path.read_bytes()
        assert len(data) == 84 + 50 * len(TRIANGLES)
        assert not data.startswith(b"solid")  # as texts do
        assert read_mesh_arrays(path).comments == tuple(kept)
        seen_by_trimesh(path)
    assert read_mesh_arrays(write(tmp_path / "b.stl", comments=["a"], binary=False)).comments == ()


def test_what_other_programs_write_where_stl_has_comments_is_left_out(tmp_path):
    data = write(tmp_path / "a.stl").read_bytes()
    for title in (b"", b"Exported from Blender", b"COLOR=\xff\x00\n", b"binary STL output\nmine"):
        (tmp_path / "b.stl").write_bytes(title.ljust(80, b"\0") + data[80:])
        assert read_mesh_arrays(tmp_path / "b.stl").comments == ()


def test_comments(tmp_path):
    comments = ["made by hand", "café"]
    assert "# made by hand\n# café\nv 0" in write(tmp_path / "a.obj", comments=comments).read_text("utf-8")
    assert _chunks(write(tmp_path / "a.glb", comments=comments))[0]["asset"]["extras"]["comments"] == comments


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"normals": NORMALS[:2]}, r"normals must have one row per point of points \(4\), got 2"),
        ({"colors": COLORS[:, :2]}, r"colors must have shape \(4, 3\)"),
        ({"colors": COLORS + 0.5}, "colors must be integers from 0 to 255"),
        ({"binary": 1}, "binary must be True or False, got 1"),
        ({"comments": "one"}, "comments must be a sequence of strings"),
    ],
)
def test_illegal_arguments_write_nothing(tmp_path, suffix, arguments, message):
    with pytest.raises((ValueError, TypeError), match=message):
        write(tmp_path / f"a{suffix}", **arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".glb", ".stl"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_vertices_that_do_not_fit(tmp_path, suffix, value):
    vertices = TETRAHEDRON.copy()
    vertices[2, 1] = value
    with pytest.raises(ValueError, match="vertices must be finite, and fit float32"):
        write(tmp_path / f"a{suffix}", vertices)
    assert not list(tmp_path.iterdir())


def _doubled_normals():
    a, b, c = (TETRAHEDRON[TRIANGLES[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def _chunks(path):
    """Return the JSON document and the binary chunk of a GLB file."""
    data = path.read_bytes()
    assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def _primitives(document):
    return [primitive for mesh in document["meshes"] for primitive in mesh["primitives"]]


UV = np.array([[0, 0], [1, 0], [0, 1], [0.75, 0.5], [0.25, 0.25]], np.float32)
CORNERS = np.array([[0, 1, 2], [2, 1, 3], [3, 4, 0], [4, 4, 2]], np.int32)
RAMP = np.repeat(np.arange(0, 256, 8, dtype=np.uint8), 3).reshape(1, 32, 3).repeat(24, axis=0)
TEXTURE = Texture(RAMP, UV, CORNERS)


class TestTexture:
    @pytest.mark.parametrize("name", ["a.glb", "my mesh.obj"])
    def test_another_program_sees_image_and_corners(self, tmp_path, name):
        path = write(tmp_path / name, normals=NORMALS, colors=COLORS, texture=TEXTURE)
        seen = seen_by_trimesh(path)
        np.testing.assert_allclose(seen.triangles, TETRAHEDRON[TRIANGLES], rtol=1e-6)
        np.testing.assert_allclose(seen.vertex_normals[seen.faces], NORMALS[TRIANGLES], atol=1e-6)
        np.testing.assert_allclose(seen.visual.uv[seen.faces] * (1, -1) + (0, 1), UV[CORNERS], atol=1e-6)
        material = seen.visual.material
        image = material.baseColorTexture if path.suffix == ".glb" else material.image
        assert np.abs(np.asarray(image.convert("RGB"), int) - RAMP).max() < 6  # JPEG
        assert len(seen.vertices) <= len(np.unique(np.stack([TRIANGLES, CORNERS]).reshape(2, -1), axis=1).T)

    def test_files_beside_an_obj_file(self, tmp_path):
        path = write(tmp_path / "a.obj", colors=COLORS, texture=TEXTURE)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mtl", "a.obj", "a_texture.jpg"]
        assert "mtllib a.mtl\nusemtl texture\nv 0.0 0.0 0.0\n" in path.read_text()
        assert "map_Kd a_texture.jpg\n" in (tmp_path / "a.mtl").read_text()
        assert len(nacre.read_mesh(path).triangles) == 4

    def test_a_glb_file_has_it_in_place_of_colours(self, tmp_path):
        document, binary = _chunks(write(tmp_path / "a.glb", colors=COLORS, texture=TEXTURE))
        (primitive,) = _primitives(document)
        assert set(primitive["attributes"]) == {"POSITION", "TEXCOORD_0"}
        assert document["buffers"][0]["byteLength"] == len(binary)
        view = document["bufferViews"][document["images"][0]["bufferView"]]
        assert binary[view["byteOffset"] :].startswith(b"\xff\xd8\xff")

    @pytest.mark.parametrize("suffix", [".glb", ".obj"])
    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"image": RAMP[..., :1]}, r"texture.image must be \(H, W, 3\) uint8, got \(24, 32, 1\)"),
            ({"image": RAMP / 255}, r"texture.image must be \(H, W, 3\) uint8, got .* of float64"),
            ({"image": RAMP[:0]}, r"texture.image must be \(H, W, 3\) uint8, got \(0, 32, 3\)"),
            ({"uv": UV[:, :1]}, r"texture.uv must be \(N, 2\) finite numbers, got shape \(5, 1\)"),
            ({"uv": np.full_like(UV, np.nan)}, r"texture.uv must be \(N, 2\) finite numbers"),
            ({"triangles": CORNERS[:2]}, r"texture.triangles must have one row per triangle \(4\), got 2"),
            ({"triangles": CORNERS + 1}, r"texture.triangles must hold indices of the 5 vertices, got 5"),
        ],
    )
    def test_what_does_not_fit_writes_nothing(self, tmp_path, suffix, change, message):
        with pytest.raises(ValueError, match=message):
            write(tmp_path / f"a{suffix}", texture=dataclasses.replace(TEXTURE, **change))
        assert not list(tmp_path.iterdir())

    def test_other_things_are_no_texture(self, tmp_path):
        with pytest.raises(TypeError, match=r"texture must be a nacre\.meshing\.Texture, got ndarray"):
            write(tmp_path / "a.glb", texture=RAMP)

    @pytest.mark.parametrize("suffix", [".ply", ".stl"])
    def test_formats_without(self, tmp_path, suffix):
        with pytest.raises(
            ValueError, match=r"textured meshes are written to .glb, .obj, got .*a\.(ply|stl)"
        ):
            write(tmp_path / f"a{suffix}", texture=TEXTURE)
        assert not list(tmp_path.iterdir())

    def test_a_name_of_two_lines(self, tmp_path):
        with pytest.raises(ValueError, match="path must be a name that fits a line of an OBJ file"):
            write(tmp_path / "a\nb.obj", texture=TEXTURE)
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("suffix", [".glb", ".obj"])
    def test_without_pillow(self, tmp_path, monkeypatch, suffix):
        monkeypatch.setitem(sys.modules, "PIL", None)
        monkeypatch.setitem(sys.modules, "PIL.Image", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[images\]"'):
            write(tmp_path / f"a{suffix}", texture=TEXTURE)
        assert not list(tmp_path.iterdir())
