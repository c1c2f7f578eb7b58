"""Where surfaces end: loops whose every vertex is known."""

import numpy as np
import pytest

from nacre.meshing import boundary_loops


def sheet(rows, columns, left_out=()):
    """Return two triangles for each cell of a grid, counter-clockwise, but of the cells that are left out."""
    corners = []
    for row in range(rows):
        for column in range(columns):
            if (row, column) not in left_out:
                a = row * (columns + 1) + column
                b, c, d = a + 1, a + columns + 2, a + columns + 1
                corners += [(a, b, c), (a, c, d)]
    return np.array(corners)


def turned_to(loop, first):
    """Return a loop from one of its vertices on."""
    return np.roll(loop, -list(loop).index(first)).tolist()


def test_the_rim_runs_as_the_triangles_do():
    (rim,) = boundary_loops(sheet(2, 2))
    assert rim.dtype == np.int32
    assert turned_to(rim, 0) == [0, 1, 2, 5, 8, 7, 6, 3]


def test_a_hole_runs_the_other_way():
    rim, hole = boundary_loops(sheet(3, 3, [(1, 1)]))
    assert len(rim) == 12
    assert turned_to(hole, 5) == [5, 9, 10, 6]


def test_surfaces_that_touch_in_a_vertex_have_loops_of_their_own():
    loops = boundary_loops(sheet(2, 2, [(0, 1), (1, 0)]))
    assert sorted(turned_to(loop, loop.min()) for loop in loops) == [[0, 1, 4, 3], [4, 5, 8, 7]]


def test_holes_that_touch_in_a_vertex_are_one_loop():
    rim, hole = boundary_loops(sheet(4, 4, [(1, 1), (2, 2)]))
    assert len(rim) == 16
    assert turned_to(hole, 6) == [6, 11, 12, 17, 18, 13, 12, 7]


def test_a_closed_surface_has_none():
    assert boundary_loops([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) == []
    assert boundary_loops(np.zeros((0, 3), int)) == []


@pytest.mark.parametrize(
    ("triangles", "message"),
    [
        ([[0, 1]], r"triangles must .*, got"),
        ([[0, 1, -1]], "triangles must"),
        ([[0.5, 1, 2]], "triangles must"),
        ([[0, 1, 2], [0, 1, 3]], "each edge once in each direction, got two from vertex 0 to 1"),
    ],
)
def test_misuse(triangles, message):
    with pytest.raises((TypeError, ValueError), match=message):
        boundary_loops(triangles)
