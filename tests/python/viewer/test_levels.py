"""Levels of detail: every point is in one node, and what is damaged or not there is told."""

from __future__ import annotations

import json
import os
import struct
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.errors import FileFormatError
from nacre.io import copc_reader
from nacre.viewer import Controls, Snapshot, Timeline, Viewer, export_html, in_frame_of, read_timeline
from nacre.viewer.levels import STEPS, Levels, name_of, pack_node, pack_tree
from nacre.viewer.page_data import PageData
from nacre.viewer.snapshot_levels import SnapshotLevels

sys.path.insert(0, str(Path(__file__).parents[1]))
from asked_server import ask, refused
from command_line import run
from hills import hills
from packed_columns import header_of, unpacked
from viewer_scenes import plane, two_looks

CLOUD = hills()
RISE = np.array([0, 0, 0.5])


@pytest.fixture
def served(hill: Path) -> Iterator[Viewer]:
    viewer = Viewer(read_timeline(hill), port=0)
    yield viewer
    viewer.close()


def all_points(read: Any, name: str, origin: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the coordinates of the points of every node, as the page places them."""
    parts = []
    for *key, count in unpacked(read(f"tree/{name}"))["nodes"].tolist():
        block = read(f"node/{name}/{name_of(tuple(key))}")
        header, columns = header_of(block), unpacked(block)
        assert len(columns["points"]) == len(columns["sizes"]) == count
        parts.append(origin + np.array(header["origin"]) + header["step"] * columns["points"])
    return np.concatenate(parts)


def assert_same(found: npt.NDArray[np.float64], expected: npt.NDArray[Any], tolerance: float) -> None:
    """Assert that each point was found once."""
    origin = expected[0].astype(np.float64)
    distances, rows = nacre.KdTree(found - origin).query(expected - origin)
    assert distances.max() < tolerance
    assert sorted(rows) == list(range(len(found)))


def test_the_nodes_have_every_point_of_a_file_once(served: Viewer, hill: Path) -> None:
    document = json.loads(ask(served, "/data/document").body)
    (state,) = document["runs"][0]["states"]
    assert (state["isStreamed"], state["total"]) == (True, len(CLOUD))
    origin = np.array(document["runs"][0]["origin"])
    found = all_points(lambda name: ask(served, f"/data/{name}").body, state["name"], origin)
    assert_same(found, CLOUD.points, 1e-5)
    assert document["view"]["up"] == [0, 0, 1]


def test_a_node_has_what_its_points_have(hill: Path) -> None:
    levels = read_timeline(hill).levels
    assert levels is not None
    columns = unpacked(pack_node(levels, "0-0-0-0"))
    assert columns["colors"].shape == columns["points"].shape
    assert columns["points"].max() < STEPS
    assert levels.read((0, 0, 0, 0)).normals[:, 2].min() > 0  # upwards
    finer = [key for key in levels.counts if key[0] == 1]
    assert levels.read(finer[0]).spacing == levels.spacing / 2


@pytest.mark.parametrize(
    "node",
    ["", "0", "0-0-0", "0-0-0-0-0", "0-1-0-0", "31-0-0-0", "-1-0-0-0", "a-0-0-0", "0-0-0-\u0660", "9" * 400],
)
def test_there_are_no_other_nodes(served: Viewer, node: str) -> None:
    (name,) = (state["name"] for state in json.loads(served.data.document)["runs"][0]["states"])
    assert refused(served, f"/data/node/{name}/{quote(node)}") == 404
    assert refused(served, f"/data/node/9/9/9/{quote(node)}") == 404
    assert refused(served, "/data/tree/9/9/9") == 404


def model(num_points: int = 40_000) -> Snapshot:
    random = np.random.default_rng(1)
    points = random.uniform(-3, 3, (num_points, 3)).astype(np.float32)
    points[:, 2] = np.sin(points[:, 0])
    normals = np.broadcast_to(np.float32([0, 0, -1]), points.shape)
    return Snapshot(points, normals, 0.02, confidence=np.arange(1, num_points + 1, dtype=np.float32))


@pytest.fixture
def few_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nacre.viewer.page_data.MAX_POINTS", 10_000)
    monkeypatch.setattr("nacre.io.octree._LEAF", 1000)


@pytest.mark.usefixtures("few_at_once")
def test_a_large_model_in_memory_is_streamed(tmp_path: Path) -> None:
    timeline = two_looks(model())
    viewer = Viewer(timeline, port=0)
    try:
        (state,) = json.loads(ask(viewer, "/data/document").body)["runs"][0]["states"]
        assert state["isStreamed"]
        found = all_points(lambda name: ask(viewer, f"/data/{name}").body, state["name"], timeline.origin)
        assert_same(found, model().points, 1e-6)
        block = ask(viewer, f"/data/node/{state['name']}/0-0-0-0").body
        assert "confidence" in unpacked(block)
        assert len(unpacked(ask(viewer, f"/data/coarse/{state['name']}").body)["points"]) == 40_000
        assert len(unpacked(ask(viewer, f"/data/points/{state['name']}").body)["points"]) == 10_000
    finally:
        viewer.close()


@pytest.mark.usefixtures("few_at_once")
@pytest.mark.parametrize("what", ["small", "growing", "live", "compared", "mesh"])
def test_what_is_not_streamed(what: str) -> None:
    timeline = two_looks(plane() if what == "small" else model())
    timeline.is_growing = what == "growing"
    if what == "mesh":
        timeline.set_snapshot(replace(model(), triangles=np.zeros((1, 3), np.int32)))
    others = [timeline] * (what == "compared")
    data = PageData([timeline, *others], is_live=what == "live")
    states = [state for run in json.loads(data.document)["runs"] for state in run["states"]]
    assert not any(state["isStreamed"] for state in states)
    with pytest.raises(KeyError):
        data.read(f"tree/{states[-1]['name']}")


@pytest.mark.usefixtures("few_at_once")
def test_points_in_one_place_and_a_single_point() -> None:
    for count in (1, 5000):
        same = Snapshot(np.ones((count, 3), np.float32), np.ones((count, 3), np.float32), 0.1)
        levels: Levels = SnapshotLevels(same)
        assert sum(levels.counts.values()) == count
        assert sum(len(levels.read(key).points) for key in levels.counts) == count
        assert len(unpacked(pack_tree(levels))["nodes"]) == len(levels.counts)


def test_a_page_without_a_server_has_the_coarse_points(
    hill: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.saved_timeline._COARSE_POINTS", 10_000)
    timeline = read_timeline(hill)
    shown = len(timeline.snapshots[-1][1].points)
    assert 0 < shown <= 10_000 < timeline.num_points == len(CLOUD)
    export_html(timeline, tmp_path / "view.html", triangles=False)
    assert (tmp_path / "view.html").stat().st_size > 10_000


def test_the_terminal_tells_how_many_points_an_exported_page_has(
    hill: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.page_data.MAX_POINTS", 1000)
    told = run("view", hill, "--html", tmp_path / "view.html")
    assert told.code == 0
    assert "1 000 of 24 000, evenly" in told.out.replace("\N{NARROW NO-BREAK SPACE}", " ")


def test_points_far_from_the_origin_keep_their_digits(tmp_path: Path) -> None:
    nacre.write_points(tmp_path / "far.ply", CLOUD.points)
    timeline = read_timeline(tmp_path / "far.ply")
    found = timeline.origin + timeline.snapshots[-1][1].points
    np.testing.assert_allclose(found, CLOUD.points, atol=1e-5)
    nacre.write_points(tmp_path / "shifted.ply", CLOUD.points + RISE)
    other = in_frame_of(timeline, read_timeline(tmp_path / "shifted.ply"))
    moved = other.origin + other.snapshots[-1][1].points
    np.testing.assert_allclose(moved, CLOUD.points + RISE, atol=1e-4)


def test_more_points_than_are_read_at_once_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.saved_timeline._MOST_POINTS", 1000)
    nacre.write_points(tmp_path / "many.ply", CLOUD.points)
    with pytest.raises(FileFormatError, match=r"nacre convert many.ply many.copc.laz"):
        read_timeline(tmp_path / "many.ply")


HIERARCHY = 375 + 54 + 40  # of the first record: where the place of the hierarchy stands


def damaged(hill: Path, folder: Path, change: Any) -> Path:
    path = folder / "damaged.copc.laz"
    data = bytearray(hill.read_bytes())
    place, size = struct.unpack_from("<2Q", data, HIERARCHY)
    change(data, place, size)
    path.write_bytes(data)
    return path


def put(kind: str, at: int, *values: Any) -> Any:
    """Return what writes values into an entry of the hierarchy."""
    return lambda data, place, size: struct.pack_into(kind, data, place + at, *values)


DAMAGES = {
    "hierarchy beyond the file": lambda data, place, size: struct.pack_into("<Q", data, HIERARCHY, 1 << 60),
    "hierarchy too long": lambda data, place, size: struct.pack_into("<Q", data, HIERARCHY + 8, 1 << 50),
    "half an entry": lambda data, place, size: struct.pack_into("<Q", data, HIERARCHY + 8, size - 7),
    "a page that names itself": lambda data, place, size: struct.pack_into(
        "<Q2i", data, place + 48, place, size, -1
    ),
    "a node beyond the file": put("<Q", 16, 1 << 63),
    "no bytes": put("<i", 24, 0),
    "negative bytes": put("<i", 24, -5),
    "absurd points": put("<i", 28, 2**31 - 1),
    "negative points": put("<i", 28, -2),
    "a level too deep": put("<i", 0, 40),
    "a negative level": put("<i", 0, -1),
    "a node beside the root": put("<i", 4, 1),
    "a node twice": lambda data, place, size: data.__setitem__(
        slice(place + 32, place + 64), data[place : place + 32]
    ),
    "fewer points": put("<i", 28, 17),
    "no side": lambda data, place, size: struct.pack_into("<d", data, HIERARCHY - 16, np.nan),
    "truncated": lambda data, place, size: data.__delitem__(slice(len(data) // 2, None)),
    "only a header": lambda data, place, size: data.__delitem__(slice(375, None)),
    "no COPC record": lambda data, place, size: data.__setitem__(slice(377, 381), b"cops"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_hierarchy_is_told(hill: Path, tmp_path: Path, damage: str) -> None:
    with pytest.raises(FileFormatError):
        read_timeline(damaged(hill, tmp_path, DAMAGES[damage]))


def test_a_file_without_nodes_has_no_points(tmp_path: Path) -> None:
    pytest.importorskip("laspy")
    nacre.write_points(tmp_path / "none.copc.laz", np.zeros((0, 3)))
    data = PageData([read_timeline(tmp_path / "none.copc.laz")])
    assert json.loads(data.document)["view"] is None


def test_other_las_files_are_no_copc(hill: Path, tmp_path: Path) -> None:
    nacre.write_points(tmp_path / "hill.laz", CLOUD)
    (tmp_path / "hill.laz").rename(tmp_path / "hill.copc.laz")
    with pytest.raises(FileFormatError, match="not a COPC file"):
        copc_reader.CopcFile(tmp_path / "hill.copc.laz")
    (tmp_path / "text.copc.laz").write_text("no")
    with pytest.raises(FileFormatError):
        copc_reader.CopcFile(tmp_path / "text.copc.laz")


def test_damaged_points_cost_their_node_alone(hill: Path, tmp_path: Path) -> None:
    """Each byte of the chunks of two nodes is damaged in turn, every 61st of them."""
    with copc_reader.CopcFile(hill) as file:
        deepest = max(file.counts)
        chunk = file._chunks[deepest]
    for at in [*range(0, 200, 7), *range(200, chunk.num_bytes, 997)]:
        path = damaged(hill, tmp_path, lambda data, place, size, at=at: flip(data, chunk.place + at))
        with copc_reader.CopcFile(path) as file:
            with suppress(FileFormatError):
                assert len(file.read(deepest)) == chunk.num_points
            assert len(file.read((0, 0, 0, 0))) == file.counts[0, 0, 0, 0]


def flip(data: bytearray, at: int) -> None:
    data[at] ^= 0xFF


def test_a_file_that_is_overwritten_while_it_is_looked_at(hill: Path, tmp_path: Path) -> None:
    path = damaged(hill, tmp_path, lambda data, place, size: None)
    viewer = Viewer(read_timeline(path), port=0)
    try:
        (name,) = (state["name"] for state in json.loads(viewer.data.document)["runs"][0]["states"])
        assert ask(viewer, f"/data/node/{name}/0-0-0-0").status == 200
        os.truncate(path, 1000)
        assert refused(viewer, f"/data/node/{name}/0-0-0-0") == 404
        assert ask(viewer, "/data/document").status == 200
    finally:
        viewer.close()


def test_a_file_that_is_replaced_is_shown_as_it_was(hill: Path, tmp_path: Path) -> None:
    path = damaged(hill, tmp_path, lambda data, place, size: None)
    with copc_reader.CopcFile(path) as file:
        nacre.write_points(path, np.zeros((5, 3)))
        assert len(file.read((0, 0, 0, 0))) > 5


def test_controls_are_no_hindrance() -> None:
    timeline = Timeline("none", None)
    assert timeline.num_points == 0
    viewer = Viewer(timeline, port=0, controls=Controls())
    viewer.close()
