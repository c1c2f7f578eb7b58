"""Hostile meshes: OBJ, OFF, STL, and the faces of PLY."""

import struct

from hostile_files.case import Case, single
from hostile_files.ply import FACES, TEXT, text, vertices

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXT_STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\nendsolid a\n"
)
OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n"


def stl(num_facets: int, body: bytes = bytes(50)) -> bytes:
    """Return a binary STL file."""
    return bytes(80) + struct.pack("<I", num_facets) + body


def glb(text: str) -> bytes:
    """Return a GLB file of a document alone."""
    data = text.encode() + b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<III", 2, 20 + len(data), len(data)) + b"JSON" + data


_OBJ = {
    "obj empty": ("", "no face"),
    "obj nul bytes": ("\0" * 100, "line 1: cannot read"),
    "obj of another program": (b"\x7fELF\x02\x01\x01" + bytes(range(256)), "line 1: cannot read"),
    "obj of a number first": ("1 2 3\n", "line 1: cannot read"),
    "obj of points": (TRIANGLE, "no face"),
    "obj index a word": (TRIANGLE + "f 1 2 c\n", "line 4: cannot read 'f 1 2 c'"),
    "obj index missing": (TRIANGLE + "f 1 2 /3\n", "line 4: cannot read"),
    "obj index 0": (TRIANGLE + "f 0 1 2\n", "line 4: cannot read"),
    "obj index beyond": (TRIANGLE + "f 1 2 4\n", "face 0 names vertex 3"),
    "obj index beyond in the second face": (TRIANGLE + "f 1 2 3\nf 1 2 4\n", "face 1 names vertex 3"),
    "obj index of 30 digits": (TRIANGLE + f"f 1 2 {10**30}\n", "line 4: cannot read"),
    "obj index 2 to the 64": (TRIANGLE + f"f 1 2 {2**64}\n", "line 4: cannot read"),
    "obj index of 5000 digits": (TRIANGLE + f"f 1 2 {'9' * 5000}\n", "line 4: cannot read"),
    "obj index back beyond": (TRIANGLE + "f -1 -2 -4\n", "line 4: cannot read"),
    "obj face of two": (TRIANGLE + "f 1 2\n", "face 0 has 2 corners"),
    "obj face of none": (TRIANGLE + "f\n", "face 0 has 0 corners"),
    "obj vertex a word": (TRIANGLE + "v 1 2 z\nf 1 2 3\n", "line 4: cannot read 'v 1 2 z'"),
    "obj vertex with an underscore": (TRIANGLE + "v 1 2 1_0\nf 1 2 3\n", "line 4: cannot read"),
    "obj vertex of two": ("v 0 0\nf 1 1 1\n", "line 1: cannot read"),
    "obj vertex nan": (TRIANGLE.replace("1 0 0", "nan 0 0") + "f 1 2 3\n", "finite"),
    "obj vertex 1e400": (TRIANGLE.replace("1 0 0", "1e400 0 0") + "f 1 2 3\n", "finite"),
}
_OFF = {
    "off without OFF": ("3 1 0\n", "line 1: an OFF file begins with 'OFF'"),
    "off empty": ("", "begins with 'OFF'"),
    "off of four dimensions": ("4" + OFF + "3 0 1 2\n", "begins with 'OFF'"),
    "off binary": (b"OFF BINARY\n\0\0\0\4\0\0\0\1", "line 1: cannot read 'BINARY'"),
    "off without counts": ("OFF\n", "line 1"),
    "off of one count": ("OFF\n4\n", "line 2"),
    "off count huge": (
        OFF.replace("3 1 0", f"{10**15} 1 0"),
        "line 5: .*after 3 of 1000000000000000 vertices",
    ),
    "off count of faces huge": (
        OFF.replace("3 1 0", f"3 {10**12} 0") + "3 0 1 2\n",
        "after 3 of 3 vertices and 1 of 1000000000000 faces",
    ),
    "off count negative": (OFF.replace("3 1 0", "-3 1 0"), "line 2: cannot read"),
    "off face cut": (OFF + "3 0 1\n", "line 6: cannot read"),
    "off vertex cut": (OFF.replace("1 0 0", "0 0"), "line 4: cannot read '0 0'"),
    "off face of one": (OFF + "1 0\n", "face 0 has 1 corners"),
    "off face negative": (OFF + "3 0 1 -1\n", "line 6: cannot read"),
    "off face of 30 digits": (OFF + f"3 0 1 {10**30}\n", "line 6: cannot read"),
    "off face missing": (OFF, "0 of 1 faces"),
    "off face beyond": (OFF + "3 0 1 3\n", "face 0 names vertex 3"),
    "off face of 1e9": (OFF + f"{10**9} 0 1 2\n", "line 6: cannot read"),
    "off goes on": (OFF + "3 0 1 2\n3 0 1 2\n", "line 7: more lines"),
}
_STL = {
    "stl empty": (b"", "byte 0: neither"),
    "stl count huge": (stl(2**32 - 1), "byte 80: .*4294967295 facets"),
    "stl of 34 bytes": (b"STL:" + bytes(30), "neither a binary STL file nor"),
    "stl short like text": (b"solid".ljust(83, b"\0"), "line 1"),
    "stl cut like text": (b"solid" + stl(1)[5:-1], "line 1"),
    "stl cut": (stl(1)[:-1], "byte 80: .*1 facets has 134 bytes, this one 133"),
    "stl goes on": (stl(1, bytes(51)), "byte 80"),
    "stl nan": (stl(1, b"\xff" * 50), "finite"),
    "stl text cut": (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "before 'endsolid'"),
    "stl text without its end": (TEXT_STL[:-11], "the file ends before 'endsolid'"),
    **{
        f"stl text {what}": (TEXT_STL.replace(old, new, 1), f"line {line}: cannot read")
        for what, old, new, line in (
            ("without the end of a facet", "endfacet\n", "", 8),
            ("with two corners", "vertex 1 0 0\n", "", 6),
            ("with four corners", "endloop", "vertex 1 2 3\nendloop", 7),
            ("with a word", "vertex 1 0 0", "vertex 1 0 z", 5),
            ("without solid", "solid a", "solidus", 1),
        )
    },
    "stl text vertex of two": (b"solid a\nfacet\nouter loop\nvertex 0 0\n", "line 4: cannot read"),
    "stl of no facets": (stl(0, b""), "no triangle|at least one|triangles"),
}
_PLY = {
    "ply without faces": (text(TEXT), "no element face"),
    "ply face beyond": (text(TEXT + "3 0 1 2\n", f"{vertices(2)}\n{FACES}"), "face 0 names vertex 2"),
    "ply face negative": (text(TEXT + "3 0 1 -1\n", f"{vertices(2)}\n{FACES}"), "face 0 names vertex -1"),
    "ply face of two": (text(TEXT + "2 0 1\n", f"{vertices(2)}\n{FACES}"), "face 0 has 2 corners"),
    "ply face no list": (
        text(TEXT + "3\n", f"{vertices(2)}\n{FACES.replace('list uchar ', '')}"),
        "no element face with",
    ),
    "ply face cut": (
        text(TEXT + "3 0 1", f"{vertices(2)}\n{FACES}"),
        "line 12: .*not hold 3 values",
    ),
    "ply face of floats": (
        text(TEXT + "3 0 1 0\n", f"{vertices(2)}\n{FACES.replace('int', 'float')}"),
        "no element face with",
    ),
}
_GLB = {
    "glb empty": (b"", "byte 0: a GLB file begins"),
    "glb of another program": (b"\x7fELF" + bytes(100), "byte 0: a GLB file begins"),
    "glb of version 1": (b"glTF" + struct.pack("<III", 1, 20, 0) + b"JSON", "byte 4: glTF of version 1"),
    "glb length huge": (glb("{}").replace(b"\x18\0\0\0", b"\xff" * 4, 1), "byte 8: the header promises"),
    "glb json huge": (b"glTF" + struct.pack("<III", 2, 20, 2**32 - 1) + b"JSON", "byte 12: the JSON chunk"),
    "glb json garbage": (glb("{oops}"), "not a JSON file"),
    "glb json nested": (glb("[" * 100_000), "not a JSON file"),
    "glb json a list": (glb("[]"), "expected a JSON object"),
    "glb without a scene": (glb("{}"), "an index of scenes must be"),
    "glb nodes in a circle": (
        glb('{"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]}'),
        "node 0 is there twice",
    ),
    "glb accessor huge": (
        glb(
            '{"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "buffers": [{}], '
            '"bufferViews": [{"buffer": 0, "byteLength": 99}], '
            '"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "accessors": '
            '[{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 1000000000000}]}'
        ),
        "accessor 0 does not end within the data",
    ),
}
_MATERIAL = "mtllib {}\nusemtl a\n" + TRIANGLE + "vt 0 0\nf 1/1 2/1 3/1\n"
_PAINTED = {
    "library leads up": (_MATERIAL.format("../a.mtl"), "", r"a\.obj, line 1: refused: .*outside"),
    "library absolute": (_MATERIAL.format("/dev/zero"), "", r"a\.obj, line 1: refused: .*outside"),
    "library missing": (_MATERIAL.format("b.mtl"), "", r"b\.mtl: it cannot be read: No such file"),
    "library of nul bytes": (_MATERIAL.format("a.mtl"), "\0" * 1000, r"a\.mtl, line 1: cannot read"),
    "image leads up": (
        _MATERIAL.format("a.mtl"), "newmtl a\nmap_Kd x/../../a.png\n", r"a\.mtl, line 2: refused: .*outside",
    ),
    "image absolute": (
        _MATERIAL.format("a.mtl"), "newmtl a\nmap_Kd /dev/zero\n", r"a\.mtl, line 2: refused: .*outside",
    ),
    "image on a drive": (
        _MATERIAL.format("a.mtl"), "newmtl a\nmap_Kd C:a.png\n", r"a\.mtl, line 2: refused: .*outside",
    ),
    "image no image": (
        _MATERIAL.format("a.mtl"), "newmtl a\nmap_Kd a.obj\n", r"a\.obj, byte 0: neither a PNG nor a JPEG",
    ),
    "place of 30 digits": (
        TRIANGLE + f"vt 0 0\nf 1/{10**30} 2/1 3/1\n", "", r"a\.obj, line 5: cannot read",
    ),
    "place beyond": (
        _MATERIAL.format("a.mtl").replace("3/1", "3/2"), "newmtl a\nmap_Kd a.png\n",
        "names texture coordinates 1, counted from 0, of 1",
    ),
}  # fmt: skip
MESHES = (
    [
        Case(
            f"painted/{name.replace(' ', '_')}",
            "painted mesh",
            {"a.obj": text.encode(), "a.mtl": material.encode(), "a.png": b"\x89PNG\r\n\x1a\n"},
            message,
        )
        for name, (text, material, message) in _PAINTED.items()
    ]
    + single("mesh", "mesh", ".obj", _OBJ)
    + single("mesh", "mesh", ".off", _OFF)
    + single("mesh", "mesh", ".stl", _STL)
    + single("mesh", "mesh", ".ply", _PLY)
    + single("mesh", "mesh", ".glb", _GLB)
)
