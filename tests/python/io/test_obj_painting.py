"""The image that is painted on the mesh of an OBJ file."""

import warnings
from io import BytesIO

import numpy as np
import pytest

import nacre
from nacre.io.meshes import read_mesh_arrays
from nacre.io.obj_painting import read_painted
from nacre.meshing import Texture

Image = pytest.importorskip("PIL.Image")

QUARTERS = np.zeros((64, 64, 3), np.uint8)  # red, green, blue and white, clockwise from the upper left
QUARTERS[:32, :32, 0] = QUARTERS[:32, 32:, 1] = QUARTERS[32:, :32, 2] = QUARTERS[32:, 32:] = 255
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLACES = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"  # from the lower left corner
FACE = "f 1/1 2/2 3/3 4/4\n"
HEAD, MATERIAL = "mtllib a.mtl\nusemtl paint\n", "newmtl paint\nmap_Kd a.png\n"


def png():
    stream = BytesIO()
    Image.fromarray(QUARTERS).save(stream, "PNG")
    return stream.getvalue()


def painted(folder, text=HEAD + SQUARE + PLACES + FACE, **files):
    """Write an OBJ file, its material and its image; others, or None, for those of these names."""
    for name, content in {"a.obj": text, "a.mtl": MATERIAL, "a.png": png(), **files}.items():
        if content is not None:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder / "a.obj"


def test_the_image_is_as_its_file_has_it_and_begins_at_the_upper_left(tmp_path):
    mesh, painting = read_painted(painted(tmp_path))
    assert painting.image == png()
    assert painting.uv.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert painting.colors("a.obj").tolist() == [[0, 0, 255], [255] * 3, [0, 255, 0], [255, 0, 0]]


def test_what_nacre_paints_is_read_back(tmp_path):
    """A vertex that is on the image twice is there twice; places are in the order of the vertices."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]])
    triangles, corners = np.array([[0, 1, 2], [2, 1, 3]]), np.array([[0, 1, 2], [4, 1, 3]], np.int32)
    places = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75], [0.9, 0.1]], np.float32)
    path = tmp_path / "a scan.obj"
    for normals in (None, np.eye(4, 3)):
        nacre.write_mesh(
            path,
            vertices,
            triangles,
            normals=normals,
            texture=Texture(QUARTERS, places, corners),
            comments=["c"],
        )
        mesh, painting = read_painted(path)
        assert len(mesh.vertices) == 5
        np.testing.assert_array_equal(mesh.vertices[mesh.triangles], vertices[triangles])
        np.testing.assert_allclose(painting.uv[mesh.triangles], places[corners], atol=1e-7)
        assert painting.image == (tmp_path / "a scan_texture.jpg").read_bytes()
        assert mesh.comments == ("c",)
    np.testing.assert_array_equal(mesh.normals[mesh.triangles], normals[triangles])
    assert len(read_mesh_arrays(path).vertices) == 4  # who asks for the mesh alone gets it whole


def test_a_surface_is_smooth_where_the_image_is_cut(tmp_path):
    roof = "v 0 0 0\nv 0 1 0\nv -1 0 -1\nv 1 0 -1\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\n"
    mesh, _ = read_painted(painted(tmp_path, HEAD + roof + "f 2/1 3/2 1/3\nf 1/4 4/1 2/2\n"))
    assert len(mesh.vertices) == 6
    ridge = mesh.vertices[:, 0] == 0
    np.testing.assert_allclose(mesh.normals[ridge], np.broadcast_to((0, 0, 1), (4, 3)), atol=1e-12)


@pytest.mark.parametrize(
    "face",
    ["f 1/1/9 2/2/9 3/3/9 4/4/9\n", "f -4/-4 -3/-3 -2/-2 -1/-1\n", "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"],
)
def test_corners_in_every_form(tmp_path, face):
    mesh, painting = read_painted(painted(tmp_path, HEAD + SQUARE + PLACES + face))
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert painting.uv.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]


def test_places_of_one_and_of_three_numbers(tmp_path):
    mesh, painting = read_painted(
        painted(tmp_path, HEAD + SQUARE + "vt 0.5\nvt 0.25 3 9\n" + "f 1/1 2/2 3/1\n")
    )
    assert painting.uv[mesh.triangles].tolist() == [[[0.5, 1], [0.25, -2], [0.5, 1]]]


@pytest.mark.parametrize(
    ("library", "files"),
    [
        ("a.mtl", {"a.mtl": "# by hand\n\nnewmtl other\nKd 1 1 1\n" + MATERIAL + "illum 1\n"}),
        ("a.mtl", {"a.mtl": "newmtl paint\n  MAP_KD\ta.png  \n".replace("\t", " ")}),
        ("a.mtl", {"a.mtl": "newmtl paint\nmap_Kd images\\a b.jpg\n", "images/a b.jpg": png()}),
        ("two words.mtl", {"a.mtl": None, "two words.mtl": MATERIAL}),
        ("b.mtl a.mtl", {"b.mtl": "newmtl other\nmap_Kd b.png\n"}),
        ("b.mtl\nmtllib a.mtl", {"b.mtl": ""}),
    ],
)  # fmt: skip
def test_materials_in_every_form(tmp_path, library, files):
    path = painted(tmp_path, f"mtllib {library}\nusemtl paint\n{SQUARE}{PLACES}{FACE}", **files)
    assert read_painted(path)[1].image == png()


@pytest.mark.parametrize(
    ("text", "material"),
    [
        (HEAD + SQUARE + "f 1 2 3 4\n", None),  # no places: the material tells of colours alone
        (SQUARE + PLACES + FACE, None),
        ("usemtl paint\n" + SQUARE + PLACES + FACE, None),
        (HEAD + SQUARE + PLACES + FACE, "newmtl paint\nKd 1 0 0\n"),
        ("mtllib a.mtl\n" + SQUARE + PLACES + FACE, MATERIAL),  # which no face has
    ],
)
def test_a_mesh_on_which_nothing_is_painted(tmp_path, text, material):
    mesh, painting = read_painted(painted(tmp_path, text, **{"a.mtl": material}))
    assert painting is None
    assert len(mesh.vertices) == 4


SEVERAL = "several images, or one on some of the faces alone"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + SQUARE + PLACES + "f 1/x 2/2 3/3\n", "a.obj, line 11: cannot read 'f 1/x 2/2 3/3'"),
        (HEAD + SQUARE + PLACES + "f 1/0 2/2 3/3\n", "line 11: cannot read"),
        (HEAD + SQUARE + PLACES + "f 1/-5 2/2 3/3\n", "line 11: cannot read"),
        (HEAD + SQUARE + PLACES + f"f 1/{10**30} 2/2 3/3\n", "line 11: cannot read"),
        (HEAD + SQUARE + PLACES + "f 1/1 2/2 3/5\n", "names texture coordinates 4, counted from 0, of 4"),
        (HEAD + SQUARE + PLACES + "f 1/1 2/2 3\n", SEVERAL),
        (HEAD + SQUARE + PLACES + FACE + "usemtl other\n" + FACE, "its material files have no 'other'"),
        (HEAD + SQUARE + PLACES + FACE + "usemtl\n" + FACE, SEVERAL),
        (HEAD + SQUARE + "vt\n" + FACE, "line 7: cannot read 'vt'"),
        (HEAD + SQUARE + "vt a\n" + FACE, "line 7: cannot read 'vt a'"),
        (HEAD + SQUARE + "vt 0 1_0\n" + FACE, "line 7: cannot read"),
        (HEAD + SQUARE + PLACES + "vt nan 0\n" + FACE, "texture coordinates must be finite"),
        (HEAD + SQUARE + PLACES + "vt 0 1e300\n" + FACE, "texture coordinates must be finite"),
        (HEAD.replace("a.mtl", "b.mtl") + SQUARE + PLACES + FACE, r"b\.mtl: it cannot be read: No such file"),
        (HEAD.replace("a.mtl", "../a.mtl") + SQUARE + PLACES + FACE, "line 1: refused: .*leads outside"),
        (HEAD.replace("a.mtl", "") + SQUARE + PLACES + FACE, "it cannot be read: Is a directory"),
    ],
)  # fmt: skip
def test_places_that_are_wrong(tmp_path, text, message):
    with pytest.raises(nacre.FileFormatError, match=message):
        read_painted(painted(tmp_path, text))


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (b"\x7fELF", r"a\.mtl, line 1: cannot read"),
        ("1 2 3\n", r"a\.mtl, line 1: cannot read '1 2 3'"),
        ("map_Kd a.png\n", r"a\.mtl, line 1: cannot read 'map_Kd a.png'"),  # of which material?
        ("newmtl\n", r"a\.mtl, line 1: cannot read 'newmtl'"),
        ("newmtl paint\nmap_Kd\n", r"a\.mtl, line 2: cannot read 'map_Kd'"),
        (
            "newmtl paint\nmap_Kd -s 2 2 a.png\n",
            r"a\.mtl, line 2: options are not read: 'map_Kd -s 2 2 a.png'",
        ),
        ("newmtl paint\nmap_Kd /etc/a.png\n", r"a\.mtl, line 2: refused: .* leads outside"),
        ("newmtl paint\nmap_Kd C:\\a.png\n", r"a\.mtl, line 2: refused: .* leads outside"),
        ("newmtl paint\nmap_Kd " + "a" * 2000 + "\n", r"a\.mtl, line 2: refused: a name of 2000 letters"),
        ("newmtl paint\nmap_Kd b.png\n", r"b\.png: it cannot be read: No such file"),
        ("newmtl paint\nmap_Kd a.mtl\n", r"a\.mtl, byte 0: neither a PNG nor a JPEG image"),
        ("newmtl other\nmap_Kd a.png\n", r"a\.obj: its material files have no 'paint'"),
        ("", r"a\.obj: its material files have no 'paint'"),
        (" " * ((1 << 24) + 1), r"a\.mtl: larger than what it can hold"),
    ],
)
def test_materials_that_are_wrong(tmp_path, material, message):
    with pytest.raises(nacre.FileFormatError, match=message):
        read_painted(painted(tmp_path, **{"a.mtl": material}))


def test_several_images_are_not_one(tmp_path):
    text = HEAD + SQUARE + PLACES + FACE + "usemtl other\n" + FACE
    other = MATERIAL + "newmtl other\nmap_Kd b.png\n"
    with pytest.raises(nacre.FileFormatError, match=SEVERAL):
        read_painted(painted(tmp_path, text, **{"a.mtl": other, "b.png": png()}))
    one = other.replace("b.png", "a.png")
    assert read_painted(painted(tmp_path, text, **{"a.mtl": one}))[1].image == png()


def test_who_reads_the_mesh_alone_is_not_told_of_its_material(tmp_path):
    path = painted(tmp_path, HEAD + SQUARE + "vt x\n" + "f 1/x 2/y 3/z\n", **{"a.mtl": None})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(nacre.read_mesh(path).vertices) == 4
