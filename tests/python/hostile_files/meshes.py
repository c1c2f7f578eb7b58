"""Hostile meshes: OBJ, OFF, STL, and the faces of PLY."""

import struct

from hostile_files.case import single
from hostile_files.ply import FACES, TEXT, text, vertices

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n"


def stl(num_facets: int, body: bytes = bytes(50)) -> bytes:
    """Return a binary STL file."""
    return bytes(80) + struct.pack("<I", num_facets) + body


_OBJ = {
    "obj empty": ("", "no face"),
    "obj nul bytes": ("\0" * 100, "line 1: cannot read"),
    "obj index 0": (TRIANGLE + "f 0 1 2\n", "line 4: cannot read"),
    "obj index beyond": (TRIANGLE + "f 1 2 4\n", "face 0 names vertex 3"),
    "obj index 2 to the 64": (TRIANGLE + f"f 1 2 {2**64}\n", "line 4: cannot read"),
    "obj index of 5000 digits": (TRIANGLE + f"f 1 2 {'9' * 5000}\n", "line 4: cannot read"),
    "obj index back beyond": (TRIANGLE + "f -1 -2 -4\n", "line 4: cannot read"),
    "obj face of two": (TRIANGLE + "f 1 2\n", "face 0 has 2 corners"),
    "obj vertex of two": ("v 0 0\nf 1 1 1\n", "line 1: cannot read"),
    "obj vertex nan": (TRIANGLE.replace("1 0 0", "nan 0 0") + "f 1 2 3\n", "finite"),
    "obj vertex 1e400": (TRIANGLE.replace("1 0 0", "1e400 0 0") + "f 1 2 3\n", "finite"),
}
_OFF = {
    "off without OFF": ("3 1 0\n", "line 1: an OFF file begins with 'OFF'"),
    "off count huge": (OFF.replace("3 1 0", f"{10**15} 1 0"), "ends after|cannot read"),
    "off count negative": (OFF.replace("3 1 0", "-3 1 0"), "line 2: cannot read"),
    "off face cut": (OFF + "3 0 1\n", "line 6: cannot read"),
    "off face missing": (OFF, "0 of 1 faces"),
    "off face beyond": (OFF + "3 0 1 3\n", "face 0 names vertex 3"),
    "off face of 1e9": (OFF + f"{10**9} 0 1 2\n", "line 6: cannot read"),
    "off goes on": (OFF + "3 0 1 2\n3 0 1 2\n", "line 7: more lines"),
}
_STL = {
    "stl empty": (b"", "byte 0: neither"),
    "stl count huge": (stl(2**32 - 1), "byte 80: .*4294967295 facets"),
    "stl cut": (stl(1)[:-1], "byte 80: .*1 facets has 134 bytes, this one 133"),
    "stl goes on": (stl(1, bytes(51)), "byte 80"),
    "stl nan": (stl(1, b"\xff" * 50), "finite"),
    "stl text cut": (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "before 'endsolid'"),
    "stl text vertex of two": (b"solid a\nfacet\nouter loop\nvertex 0 0\n", "line 4: cannot read"),
    "stl of no facets": (stl(0, b""), "no triangle|at least one|triangles"),
}
_PLY = {
    "ply without faces": (text(TEXT), "no element face"),
    "ply face beyond": (text(TEXT + "3 0 1 2\n", f"{vertices(2)}\n{FACES}"), "face 0 names vertex 2"),
    "ply face negative": (text(TEXT + "3 0 1 -1\n", f"{vertices(2)}\n{FACES}"), "face 0 names vertex -1"),
    "ply face of two": (text(TEXT + "2 0 1\n", f"{vertices(2)}\n{FACES}"), "face 0 has 2 corners"),
    "ply face of floats": (
        text(TEXT + "3 0 1 0\n", f"{vertices(2)}\n{FACES.replace('int', 'float')}"),
        "no element face with",
    ),
}
MESHES = (
    single("mesh", "mesh", ".obj", {name: (body.encode(), message) for name, (body, message) in _OBJ.items()})
    + single(
        "mesh", "mesh", ".off", {name: (body.encode(), message) for name, (body, message) in _OFF.items()}
    )
    + single("mesh", "mesh", ".stl", _STL)
    + single("mesh", "mesh", ".ply", _PLY)
)
