"""Range scans in PLY files, as the Stanford repository has them."""

import numpy as np
import pytest
from ply_files import FLOATS, POINTS, TEXT, XYZ, ascii_ply, ply

import nacre
from nacre.io.ply import read_range_grid

GRID = (
    "obj_info num_cols 3\nobj_info num_rows 2\nobj_info echo_lgincr 0.5\n"
    f"element vertex 2\n{XYZ}\nelement range_grid 6\nproperty list uchar int vertex_indices"
)
CELLS = "0\n1 1\n0\n1 0\n0\n0\n"


def test_range_grid(tmp_path):
    expected = np.full((2, 3, 3), np.nan, dtype=np.float32)
    expected[0, 1], expected[1, 0] = POINTS[1], POINTS[0]
    cells = b"\x00\x01\x01\x00\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00"
    for content in (ascii_ply(TEXT + CELLS, GRID), ply(FLOATS + cells, GRID)):
        (tmp_path / "scan.ply").write_bytes(content)
        np.testing.assert_array_equal(read_range_grid(tmp_path / "scan.ply"), expected, strict=True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ascii_ply(TEXT), "not a range scan: no element range_grid"),
        (ascii_ply(TEXT + CELLS, GRID.replace("obj_info num_cols 3\n", "")), "no line 'obj_info num_cols'"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("num_cols 3", "num_cols three")),
            "no line 'obj_info num_cols'",
        ),
        (ascii_ply(TEXT + CELLS, GRID.replace("num_rows 2", "num_rows \xb2")), "no line 'obj_info num_rows'"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("num_cols 3", "num_cols 4")),
            "num_rows 2 times num_cols 4 is not 6",
        ),
        (ascii_ply(TEXT + CELLS.replace("1 1", "1 2"), GRID), "a vertex outside 0 to 1"),
        (ascii_ply(TEXT + CELLS.replace("1 1", "1 -1"), GRID), "a vertex outside 0 to 1"),
        (ascii_ply(TEXT + CELLS.replace("1 1", "2 0 1"), GRID), "more than one vertex"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("int vertex_indices", "float vertex_indices")),
            "not a range scan",
        ),
    ],
)
def test_broken_range_grid(tmp_path, content, message):
    (tmp_path / "scan.ply").write_bytes(content)
    with pytest.raises(nacre.FileFormatError, match=message):
        read_range_grid(tmp_path / "scan.ply")


@pytest.mark.data
def test_real_range_scan(recordings):
    path = recordings / "stanford-bunny" / "data" / "bun000.ply"
    image = read_range_grid(path)
    assert image.shape == (400, 512, 3)
    seen = np.isfinite(image).all(axis=2)
    assert seen.sum() == len(nacre.read_points(path)) == 40256
    columns = np.nonzero(seen)[1]  # orthographic in x, half a millimetre a column
    slope = np.polyfit(columns, image[seen][:, 0].astype(float), 1)[0]
    assert slope == pytest.approx(0.0005, rel=1e-3)
