"""The image that is painted on the mesh of a GLB file."""

from io import BytesIO

import numpy as np
import pytest
from glb_files import LIST, SQUARE, glb

import nacre
from nacre.io.glb_reader import read_painting
from nacre.io.meshes import read_mesh_arrays
from nacre.meshing import Texture

Image = pytest.importorskip("PIL.Image")

QUARTERS = np.zeros((64, 64, 3), np.uint8)  # red, green, blue and white, clockwise from the upper left
QUARTERS[:32, :32, 0] = QUARTERS[:32, 32:, 1] = QUARTERS[32:, :32, 2] = QUARTERS[32:, 32:] = 255
UV = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]], "<f4")
SIDES = np.array([0, 1, 2, 2, 1, 3], "<u4")


def png():
    stream = BytesIO()
    Image.fromarray(QUARTERS).save(stream, "PNG")
    return stream.getvalue()


def painted(path, image=None, texture=None, uv=UV, **changes):
    """Write the square with an image, which is a column of bytes among the arrays."""
    data = np.frombuffer(png() if image is None else image, np.uint8)
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}
    document = {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **(texture or {})}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
    }
    path.write_bytes(glb([SQUARE, SIDES, uv, data], primitive, **{**document, **changes}))
    return path


def test_the_image_is_as_the_file_has_it(tmp_path):
    painting = read_painting(painted(tmp_path / "a.glb"))
    assert painting.image == png()
    np.testing.assert_array_equal(painting.uv, UV)
    assert painting.colors("a.glb").tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255] * 3]


def test_what_nacre_paints_is_read_back(tmp_path):
    """A vertex that is on the image twice is there twice; places are in the order of the vertices."""
    corners = np.array([[0, 1, 2], [4, 1, 3]], np.int32)
    places = np.concatenate([UV, [[0.9, 0.1]]]).astype(np.float32)
    nacre.write_mesh(
        tmp_path / "a.glb", SQUARE, SIDES.reshape(2, 3), texture=Texture(QUARTERS, places, corners)
    )
    mesh, painting = read_mesh_arrays(tmp_path / "a.glb"), read_painting(tmp_path / "a.glb")
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], SQUARE[SIDES].reshape(2, 3, 3))
    np.testing.assert_array_equal(painting.uv[mesh.triangles], places[corners])
    assert (
        np.abs(painting.colors("a.glb")[mesh.triangles[0]] - [[255.0, 0, 0], [0, 255, 0], [0, 0, 255]]).max()
        < 9
    )


def test_beyond_its_borders_an_image_begins_again(tmp_path):
    painting = read_painting(painted(tmp_path / "a.glb", uv=UV + np.float32(3)))
    assert painting.colors("a.glb")[1].tolist() == [0, 255, 0]


def test_places_may_be_moved_on_the_image(tmp_path):
    """KHR_texture_transform: scaled, turned by a right angle, and shifted."""
    change = {"scale": [0.5, 1.0], "rotation": np.pi / 2, "offset": [0.0, 1.0]}
    path = painted(tmp_path / "a.glb", texture={"extensions": {"KHR_texture_transform": change}})
    np.testing.assert_allclose(
        read_painting(path).uv, np.stack([UV[:, 1], 1 - 0.5 * UV[:, 0]], axis=1), atol=1e-6
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"materials": [{}]},
        {"images": [{"uri": "a.png"}]},
        {"images": [{"bufferView": 0}]},  # neither PNG nor JPEG
    ],
)
def test_no_image_that_can_be_shown(tmp_path, changes):
    assert read_painting(painted(tmp_path / "a.glb", **changes)) is None


def test_several_images_are_not_one(tmp_path):
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1}
    pieces = [{"primitives": [{**primitive, "material": k}]} for k in (0, 1)]
    materials = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in (0, 1)]
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 1}]
    images = [{"bufferView": 3}, {"bufferView": 3}]
    textures = [{"source": 0}, {"source": 1}]
    path = painted(
        tmp_path / "a.glb", meshes=pieces, materials=materials, nodes=nodes, images=images, textures=textures
    )
    assert read_painting(path) is None
    one = painted(
        tmp_path / "b.glb", meshes=pieces, materials=materials, nodes=nodes, textures=[{"source": 0}] * 2
    )
    assert len(read_painting(one).uv) == 8


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"uv": UV[:3]}, "TEXCOORD_0 must be finite places of the 4 vertices, got 3"),
        ({"uv": UV * np.float32(np.nan)}, "TEXCOORD_0 must be finite places"),
        ({"textures": []}, "an index of textures must be a whole number below 0, got 0"),
        ({"images": []}, "an index of images must be a whole number below 0, got 0"),
        ({"texture": {"texCoord": 1}}, "an index of accessors must be"),
        ({"texture": {"extensions": {"KHR_texture_transform": {"scale": [1]}}}}, "scale must be a list of 2"),
    ],
)
def test_places_and_images_that_are_wrong(tmp_path, changes, message):
    path = painted(tmp_path / "a.glb", **changes)
    with pytest.raises(nacre.FileFormatError, match=message):
        read_painting(path)
    assert len(read_mesh_arrays(path).vertices) == 4  # the mesh itself is whole


def test_a_mesh_without_material(tmp_path):
    (tmp_path / "a.glb").write_bytes(glb([SQUARE, SIDES], LIST))
    assert read_painting(tmp_path / "a.glb") is None
