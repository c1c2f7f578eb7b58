"""GLB files of other programs, and files that are none."""

import json
import struct

import numpy as np
import pytest
from glb_files import LIST, SQUARE, glb, packed

import nacre
from nacre.io.meshes import read_mesh_arrays


def read(tmp_path, content):
    (tmp_path / "a.glb").write_bytes(content)
    return read_mesh_arrays(tmp_path / "a.glb")


@pytest.mark.parametrize(
    ("corners", "mode", "triangles"),
    [
        ([0, 1, 2, 2, 1, 3], 4, [[0, 1, 2], [2, 1, 3]]),
        ([0, 1, 2, 3], 5, [[0, 1, 2], [2, 1, 3]]),
        ([0, 1, 3, 2], 6, [[0, 1, 3], [0, 3, 2]]),
    ],
)
@pytest.mark.parametrize("dtype", ["u1", "<u2", "<u4"])
def test_lists_strips_and_fans(tmp_path, corners, mode, triangles, dtype):
    mesh = read(tmp_path, glb([SQUARE, np.array(corners, dtype)], {**LIST, "mode": mode}))
    np.testing.assert_array_equal(mesh.vertices, SQUARE)
    assert mesh.triangles.tolist() == triangles


def test_corners_without_indices(tmp_path):
    mesh = read(tmp_path, glb([SQUARE[:3]], {"attributes": {"POSITION": 0}}))
    assert mesh.triangles.tolist() == [[0, 1, 2]]


def test_comments_can_be_written_to_any_format(tmp_path):
    asset = {"version": "2.0", "extras": {"comments": ["one\ntwo", "\ud800", 3]}}
    mesh = read(tmp_path, glb([SQUARE[:3]], {"attributes": {"POSITION": 0}}, asset=asset))
    assert mesh.comments == ("one", "two", "\\ud800")


def test_nodes_place_their_meshes(tmp_path):
    """A quarter turn about z above a shift; and a mirror, which turns the triangles round."""
    half = float(np.sqrt(0.5))
    nodes = [
        {"children": [1, 2], "rotation": [0, 0, half, half], "scale": [2, 2, 2]},
        {"mesh": 0, "translation": [1, 0, 0]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
    ]
    normals = np.tile(np.array([1, 0, 0], "<f4"), (4, 1))
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 2}, "indices": 1}
    mesh = read(tmp_path, glb([SQUARE, np.array([0, 1, 2], "u1"), normals], primitive, nodes))
    mirrored, shifted = mesh.vertices[:4], mesh.vertices[4:]
    np.testing.assert_allclose(shifted, [[0, 2, 0], [0, 4, 0], [-2, 2, 0], [-2, 4, 0]], atol=1e-12)
    np.testing.assert_allclose(mirrored, [[0, 0, 10], [0, -2, 10], [-2, 0, 10], [-2, -2, 10]], atol=1e-12)
    assert mesh.triangles.tolist() == [[2, 1, 0], [4, 5, 6]]
    np.testing.assert_allclose(mesh.normals[[0, 4]], [[0, -1, 0], [0, 1, 0]], atol=1e-12)


@pytest.mark.parametrize("dtype", ["u1", "<u2", "<f4"])
@pytest.mark.parametrize("width", [3, 4])
def test_colours_of_every_type_are_linear_light(tmp_path, dtype, width):
    largest = 1 if dtype == "<f4" else np.iinfo(dtype).max
    light = np.array([[0, 0.5, 1, 1]] * 4)[:, :width] * largest
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 2}, "indices": 1}
    mesh = read(tmp_path, glb([SQUARE, np.array([0, 1, 2], "u1"), light.astype(dtype)], primitive))
    np.testing.assert_allclose(mesh.colors, [[0, 188, 255]] * 4, atol=1)


def test_a_file_of_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((1, 2, 3))
    box.apply_translation((7, 0, 0))
    box.export(tmp_path / "a.glb")
    mesh = nacre.read_mesh(tmp_path / "a.glb")
    np.testing.assert_allclose(mesh.bounds, box.bounds)
    assert len(mesh.triangles) == 12


def broken(change):
    """Return a file whose document is changed."""
    whole = glb([SQUARE, np.array([0, 1, 2], "u1")], LIST)
    size = struct.unpack_from("<I", whole, 12)[0]
    document = json.loads(whole[20 : 20 + size])
    change(document)
    return packed(json.dumps(document).encode(), whole[28 + size :])


def setting(*place_and_value):
    *place, last, value = place_and_value

    def change(document):
        for key in place:
            document = document[key]
        document[last] = value

    return broken(change)


TWICE = [{"mesh": 0, "children": [1]}, {"children": [0]}]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "begins with 'glTF'"),
        (b"glTF" + bytes(40), "glTF of version 0"),
        (glb([SQUARE], LIST)[:-4], "the header promises"),
        (packed(b"{", b""), "not a JSON file"),
        (packed(b"[]", b""), "expected a JSON object"),
        (packed(b"{}", b""), "an index of scenes must be a whole number below 0, got 0"),
        (setting("scene", 1), "an index of scenes must be a whole number below 1, got 1"),
        (setting("nodes", TWICE), "node 0 is there twice: nodes must be a tree"),
        (setting("nodes", 0, "mesh", True), "an index of meshes"),
        (setting("nodes", [7]), "nodes must be a list of objects"),
        (setting("nodes", 0, "scale", [1, 2]), "scale must be a list of 3 numbers"),
        (setting("nodes", 0, "rotation", [0, 0, "a", 1]), "rotation must be a list of finite numbers"),
        (setting("nodes", 0, "matrix", [1e300] * 16), "matrix must be a list of finite numbers"),
        (
            setting("extensionsRequired", ["KHR_draco_mesh_compression"]),
            "extensions that are not read: KHR_draco",
        ),
        (setting("extensionsRequired", 5), "extensionsRequired must be a list"),
        (setting("meshes", 0, "primitives", 0, "mode", 1), "there is no triangle"),
        (setting("meshes", 0, "primitives", 0, "mode", -1), "mode must be a whole number"),
        (setting("meshes", 0, "primitives", 0, "indices", 0), "the type of accessor 0 must be numbers by"),
        (setting("meshes", 0, "primitives", 0, "attributes", {}), "an index of accessors"),
        (setting("accessors", 1, "count", 2), "the number of corners must be a multiple of 3, got 2"),
        (setting("accessors", 0, "count", 2), "indices must be whole numbers below 2, got 2"),
        (setting("accessors", 0, "count", 10**9), "accessor 0 does not end within the data"),
        (setting("accessors", 0, "sparse", {}), "accessor 0 is sparse"),
        (setting("bufferViews", 0, "byteStride", 4), "accessor 0 does not end within the data"),
        (setting("bufferViews", 0, "byteOffset", 10**6), "accessor 0 does not end within the data"),
        (setting("buffers", 0, "uri", "a.bin"), "its data is in another file"),
    ],
)
def test_files_that_are_none(tmp_path, content, message):
    with pytest.raises(nacre.FileFormatError, match=message):
        read(tmp_path, content)
