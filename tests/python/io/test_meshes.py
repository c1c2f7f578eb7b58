"""Meshes in every form that is legal; test_hostile_files has the others."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre.io.meshes import read_mesh_arrays, write_mesh

DATA = Path(__file__).parents[4] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no recordings in ../shared/data")

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0.5]])
FAN = [[0, 1, 2], [0, 2, 3]]
OBJ_SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0.5\n"
OFF_SQUARE = OBJ_SQUARE.replace("v ", "")
PLY_VERTICES = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"


def read(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_mesh_arrays(path)


def check_square(mesh, triangles=FAN, dtype=np.float64):
    np.testing.assert_array_equal(mesh.vertices, SQUARE.astype(dtype), strict=True)
    np.testing.assert_array_equal(mesh.triangles, np.array(triangles, dtype=np.int32), strict=True)


@pytest.mark.parametrize(
    "text",
    [
        OBJ_SQUARE + "f 1 2 3 4\n",
        OBJ_SQUARE + "f 1/1 2/2 3/3 4/4",
        OBJ_SQUARE + "f 1//9 2//9 3//9 4//9\n",
        OBJ_SQUARE + "f 1/5/9 2/6/9 3/7/9 4/8/9\n",
        OBJ_SQUARE + "f -4 -3 -2 -1\n",
        OBJ_SQUARE + "f 1 2 3\nf 1 3 4\n",
        OBJ_SQUARE + "f 1 2 3 \\\n 4\n",
        "f 1 2 3 4\n" + OBJ_SQUARE,
        "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nf 1 2 3\nv 0 1 0.5\nf -4 -2 -1\n",
        "# made by hand\nmtllib a.mtl\no square\n\n"
        + OBJ_SQUARE
        + "vn 0 0 1\nvt 0 0\ns off\nusemtl a # b\nf 1 2 3 4\n",
        (OBJ_SQUARE + "f 1 2 3 4\n").replace("\n", "\r\n"),
        OBJ_SQUARE.replace("0\n", "0 1.0 1.0 1.0\n").replace("0.5\n", "0.5 1.0\n") + "f 1 2 3 4\n",
        b"\xef\xbb\xbf" + (OBJ_SQUARE + "f 1 2 3 4\n").encode(),
        (OBJ_SQUARE + "f 1 2 3 4\n").encode() + b"# caf\xe9\n",
    ],
)
def test_obj(tmp_path, text):
    check_square(read(tmp_path, "a.obj", text))


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 1 0\n{OFF_SQUARE}4 0 1 2 3\n",
        f"OFF 4 1 4\n{OFF_SQUARE}4 0 1 2 3",
        f"OFF\n# by hand\n\n4 2\n{OFF_SQUARE}\n3 0 1 2\n3 0 2 3 255 0 0\n",
        f"COFF\n4 1 0\n{OFF_SQUARE}".replace("0\n", "0 255 0 0 255\n", 2)
        .replace("0.5\n", "0.5 1 2 3 4\n")
        .replace("4 1 0 255 0 0 255", "4 1 0")
        + "4 0 1 2 3\n",
        f"NOFF\n4 1 0\n{OFF_SQUARE}".replace("0.5\n", "0.5 0 0 1\n") + "4 0 1 2 3\n",
    ],
)
def test_off(tmp_path, text):
    check_square(read(tmp_path, "a.off", text))


def stl_binary(triangles, header=b"solid like many binary files"):
    facets = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    facets["c"] = triangles
    facets["n"] = np.nan
    return header.ljust(80, b"\0") + np.uint32(len(triangles)).tobytes() + facets.tobytes()


def stl_text(triangles):
    text = "solid a b\n"
    for corners in triangles:
        text += "facet normal nan nan nan\n outer loop\n"
        text += "".join(f"  vertex {x} {y} {z}\n" for x, y, z in corners.tolist())
        text += " endloop\nendfacet\n"
    return (text + "endsolid a b\n").encode()


@pytest.mark.parametrize("write", [stl_binary, stl_text])
def test_stl_corners_are_merged(tmp_path, write):
    check_square(read(tmp_path, "a.stl", write(SQUARE[FAN])), dtype=np.float32)
    check_square(read(tmp_path, "a.STL", write(SQUARE[FAN])), dtype=np.float32)
    empty = read(tmp_path, "b.stl", write(np.empty((0, 3, 3))))
    assert empty.vertices.shape == empty.triangles.shape == (0, 3)


def test_stl_of_several_solids_in_capitals(tmp_path):
    content = (stl_text(SQUARE[FAN[:1]]) + b"\n" + stl_text(SQUARE[FAN[1:]])).upper()
    check_square(read(tmp_path, "a.stl", content), dtype=np.float32)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(0, 30))
def test_stl_merges_as_a_dictionary_would(tmp_path_factory, seed, size):
    rng = np.random.default_rng(seed)
    signs = rng.choice([-0.1, 0.1], (size, 3, 3))
    corners = (rng.integers(0, 2, (size, 3, 3)) * signs).astype(np.float32)  # with 0 and -0
    mesh = read(tmp_path_factory.getbasetemp(), "a.stl", stl_binary(corners))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], corners)
    first_seen = list(dict.fromkeys(map(tuple, (corners + 0).reshape(-1, 3).tolist())))
    assert list(map(tuple, mesh.vertices.tolist())) == first_seen


@pytest.mark.parametrize(
    "prop",
    ["list uchar int vertex_indices", "list uint8 uint32 vertex_index", "list int short vertex_indices"],
)
def test_ply(tmp_path, prop):
    header = f"ply\nformat ascii 1.0\n{PLY_VERTICES}element face 2\nproperty {prop}\nend_header\n"
    check_square(read(tmp_path, "a.ply", header + OFF_SQUARE + "3 0 1 2\n3 0 2 3\n"), dtype=np.float32)
    mixed = header.replace("face 2", "face 3").replace("vertex 4", "vertex 5") + OFF_SQUARE + "9 9 9\n"
    mesh = read(tmp_path, "a.ply", mixed + "4 0 1 2 3\n3 1 2 3\n5 4 3 2 1 0\n")
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [1, 2, 3], [4, 3, 2], [4, 2, 1], [4, 1, 0]]
    assert len(mesh.vertices) == 5


@settings(max_examples=50, deadline=None, derandomize=True)
@given(data=st.data(), sizes=st.lists(st.integers(3, 7), max_size=10))
def test_polygons_become_fans(tmp_path_factory, data, sizes):
    faces = [data.draw(st.lists(st.integers(0, 3), min_size=size, max_size=size)) for size in sizes]
    expected = [[face[0], face[i], face[i + 1]] for face in faces for i in range(1, len(face) - 1)]
    lines = "".join(f"{len(face)} {' '.join(map(str, face))}\n" for face in faces)
    mesh = read(tmp_path_factory.getbasetemp(), "a.off", f"OFF\n4 {len(faces)} 0\n{OFF_SQUARE}{lines}")
    triangles = mesh.triangles
    assert triangles.tolist() == expected
    assert triangles.shape[1] == 3


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("index_dtype", [np.int64, np.uint8])
def test_written_meshes_are_read_again(tmp_path, dtype, binary, index_dtype):
    vertices = SQUARE.astype(dtype) + dtype(1e6)
    write_mesh(tmp_path / "a.ply", vertices, np.array(FAN, dtype=index_dtype), comments=["c"], binary=binary)
    mesh = read_mesh_arrays(tmp_path / "a.ply")
    np.testing.assert_array_equal(mesh.vertices, vertices, strict=True)
    np.testing.assert_array_equal(mesh.triangles, np.array(FAN, dtype=np.int32), strict=True)


def test_mesh_object(tmp_path):
    nacre.write_mesh(tmp_path / "a.ply", SQUARE, FAN)
    mesh = nacre.read_mesh(tmp_path / "a.ply")
    assert isinstance(mesh, nacre.Mesh)
    check_square(mesh)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (f"OFF\n4 0 0\n{OFF_SQUARE}", "triangles"),
        (f"OFF\n4 1 0\n{OFF_SQUARE}3 0 1 2\n".replace("0.5", "nan"), "vertices"),
    ],
)
def test_what_no_mesh_object_can_be_made_of(tmp_path, content, message):
    assert len(read(tmp_path, "a.off", content).vertices) == 4
    with pytest.raises(nacre.FileFormatError, match=rf"a\.off.*{message}"):
        nacre.read_mesh(tmp_path / "a.off")


@pytest.mark.parametrize(
    ("name", "vertices", "triangles", "error", "message"),
    [
        ("a.off", SQUARE, FAN, ValueError, r"\.ply, \.glb, \.obj, \.stl, got .*a\.off"),
        ("a.ply", SQUARE[:, :2], FAN, ValueError, r"vertices must have shape \(N, 3\)"),
        ("a.ply", SQUARE, [[0, 1]], ValueError, r"triangles must have shape \(N, 3\)"),
        ("a.ply", SQUARE, [[0.0, 1, 2]], TypeError, "triangles must be an array of integers"),
        ("a.ply", SQUARE, [[0, 1, 4]], ValueError, "triangles must hold indices of the 4 vertices, got 4"),
        ("a.ply", SQUARE, [[0, 1, -1]], ValueError, "triangles must hold indices of the 4 vertices, got -1"),
    ],
)
def test_illegal_arguments(tmp_path, name, vertices, triangles, error, message):
    with pytest.raises(error, match=message):
        write_mesh(tmp_path / name, vertices, triangles)
    assert not list(tmp_path.iterdir())


def test_unknown_suffix(tmp_path):
    with pytest.raises(ValueError, match=r"\.ply, \.obj, \.off, \.stl, got .*a\.3ds"):
        read_mesh_arrays(tmp_path / "a.3ds")


@pytest.mark.parametrize("suffix", [".obj", ".off", ".stl", ".ply"])
def test_missing_files_and_directories(tmp_path, suffix):
    with pytest.raises(FileNotFoundError):
        read_mesh_arrays(tmp_path / f"a{suffix}")
    (tmp_path / f"a{suffix}").mkdir()
    with pytest.raises(IsADirectoryError):
        read_mesh_arrays(tmp_path / f"a{suffix}")


@needs_data
@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "num_vertices", "num_triangles"),
    [
        ("meshes/spot.obj", 2930, 5856),
        ("meshes/homer.obj", 6002, 12000),
        ("meshes/libigl_fandisk.off", 7229, 14454),
        ("stanford-bunny/reconstruction/bun_zipper.ply", 35947, 69451),
    ],
)
def test_real_meshes(name, num_vertices, num_triangles):
    mesh = read_mesh_arrays(DATA / name)
    vertices, triangles = mesh.vertices, mesh.triangles
    assert (len(vertices), len(triangles)) == (num_vertices, num_triangles)
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    boundary = np.count_nonzero(counts == 1)
    assert boundary == (223 if "bun_zipper" in name else 0)
    assert np.count_nonzero(counts > 2) == 0
