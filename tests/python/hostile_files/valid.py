"""Small files that are as they should be, and what is in them: the seeds of damage."""

import io
import json
import struct
import zlib

import numpy as np
from pcd_files import COLUMNS, FIELDS, compressed, field_columns
from pcd_files import pcd as other_pcd
from ply_files import MIXED, mixed_binary, mixed_text

from hostile_files.cameras import OPEN3D, PINHOLE
from hostile_files.case import Case
from hostile_files.configs import TEXTS  # noqa: F401
from hostile_files.depth_images import exr, npy, pgm, png
from hostile_files.meshes import OFF, TRIANGLE, stl
from hostile_files.pcd import TWO as PCD_TWO
from hostile_files.pcd import packed, pcd
from hostile_files.ply import FACES, GRID, TEXT, TWO, ply, text, vertices
from hostile_files.trajectories import EYE, GOOD
from hostile_files.valid_folders import FOLDERS

PIXELS = np.arange(12, dtype=">u2").reshape(3, 4) + 500
ROWS = b"".join(b"\0" + row.tobytes() for row in PIXELS)
LISTS = f"{vertices(2)}\nproperty uchar q\n{FACES}"
MANY = f"{vertices(40)}\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red"
MANY += "\nproperty uchar green\nproperty uchar blue\nproperty double t"
_many = np.random.default_rng(6).normal(size=(40, 6)).astype("<f4")
_wide = b"".join(
    row.tobytes() + bytes((i, 2 * i, 3 * i)) + struct.pack("<d", i / 7) for i, row in enumerate(_many)
)


def npz(**arrays: np.ndarray) -> bytes:
    """Return an archive of arrays."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def glb() -> bytes:
    """Return a GLB file of a triangle with normals and colours."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    binary = corners.tobytes() * 2 + np.arange(3, dtype="<u4").tobytes() + bytes(range(12))
    views = [(0, 36), (36, 36), (72, 12), (84, 12)]
    kinds = [(5126, "VEC3"), (5126, "VEC3"), (5125, "SCALAR"), (5121, "VEC4")]
    fields = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 3}
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [1, 2, 3]}], "buffers": [{"byteLength": 96}],
        "meshes": [{"primitives": [{"attributes": fields, "indices": 2}]}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": size} for start, size in views],
        "accessors": [
            {"bufferView": i, "componentType": code, "type": kind, "count": 3, "normalized": code == 5121}
            for i, (code, kind) in enumerate(kinds)
        ],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    parts = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 96, b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts


FILES = {
    "points": {
        "binary.ply": ply(TWO),
        "big.ply": ply(struct.pack(">6f", *range(6)), form="binary_big_endian"),
        "text.ply": text(TEXT),
        "lists.ply": text("0 1 2 7\n3 4 5 8\n3 0 1 0\n", LISTS),
        "many.ply": ply(_wide, MANY),
        "mixed.ply": ply(mixed_binary("<"), MIXED),
        "mixed_big.ply": ply(mixed_binary(">"), MIXED, "binary_big_endian"),
        "mixed_text.ply": text(mixed_text(), MIXED),
        "binary.pcd": pcd(PCD_TWO),
        "text.pcd": pcd(b"0 1 2\n3 4 5\n", "ascii"),
        "text.xyz": b"# x y z red green blue nx ny nz q\n0 1 2 255 0 7 0 0 1 0.5\n3 4 5 1 2 3 0 1 0 0.25\n",
        "bare.xyz": b"0,1,2,9\n3,4,5,8\n",
        "arrays.npz": npz(points=_many[:, :3], normals=_many[:, 3:], labels=np.arange(40)),
        "image.pcd": pcd(PCD_TWO * 2, WIDTH=2, HEIGHT=2, POINTS=4),
        "packed.pcd": packed(23, *PCD_TWO),
        "compressed.pcd": other_pcd(compressed(COLUMNS), "binary_compressed"),
        "fields.pcd": other_pcd(
            compressed(b"".join(map(b"".join, field_columns()))), "binary_compressed", **FIELDS
        ),
        "full.pcd": pcd(
            struct.pack("<6fIHd", 0, 1, 2, 0, 0, 1, 0x102030, 7, 0.5) * 2,
            FIELDS="x y z normal_x normal_y normal_z rgb label time",
            SIZE="4 4 4 4 4 4 4 2 8",
            TYPE="F F F F F F U U F",
            COUNT="1 1 1 1 1 1 1 1 1",
        ),
    },
    "range grid": {"grid.ply": text(TEXT + "1 0\n1 1\n", GRID)},
    "mesh": {
        "a.obj": (TRIANGLE + "f 1 2 3\n").encode(),
        "a.off": (OFF + "3 0 1 2\n").encode(),
        "corners.obj": (TRIANGLE + "v 1 1 0\nf 1/2 2//3 3/4/5 -1\n# end\n").encode(),
        "colors.off": b"COFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 1\n",
        "a.glb": glb(),
        "a.stl": stl(1, struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)),
        "text.stl": b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        b"endloop\nendfacet\nendsolid\n",
        "a.ply": text("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", f"{vertices(3)}\n{FACES}"),
    },
    "depth": {
        "a.png": png(data=zlib.compress(ROWS)),
        "a.pgm": pgm(body=PIXELS.tobytes()),
        "a.npy": npy(PIXELS.astype(np.float32)),
        "a.exr": exr(),
    },
    "color": {"a.png": png(bits=8, color=2, data=zlib.compress(3 * (b"\0" + bytes(range(12)))))},
    "attribute": {
        "a.npy": npy(np.ones((3, 4, 2))),
        "a.png": png(bits=8),
        "far.npy": npy(np.full((3, 4), 1e300)),
    },
    "camera": {"camera.json": json.dumps(PINHOLE).encode(), "open3d.json": json.dumps(OPEN3D).encode()},
    "trajectory": {
        "a.txt": (GOOD + "1 0.5 0 0 0 0 0.6 0.8\n").encode(),
        "a.log": ("0 0 1\n" + EYE + "1 1 2\n" + EYE).encode(),
        "a.pose.txt": EYE.encode(),
    },
    "matrix": {"a.txt": EYE.encode()},
    "config": {
        "a.toml": b"preset = 'paper'\nmax_points = 1000\n[registration]\nmax_angle = 0.5\nrobust = false\n"
        b"[depth]\nmax_depth = 3\n",
    },
}
VALID = {
    f"{kind}/valid_{name}": Case(f"{kind}/valid_{name}", kind, {name: data}, "", name)
    for kind, files in FILES.items()
    for name, data in files.items()
}
VALID |= {case.name: case for case in FOLDERS}
