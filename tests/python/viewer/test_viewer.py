"""What the viewer tells of a run, while it grows and afterwards."""

from __future__ import annotations

import base64
import gzip
import json
import math
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.meshing import Texture
from nacre.reconstruction import Reconstruction
from nacre.report import ReportedFrame
from nacre.run_data.reported_frame import plain_reason
from nacre.viewer.page_data import PageData
from nacre.viewer.timeline import words
from nacre.viewer.view import View
from nacre.viewer.views import first_view

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import plane, two_looks

viewer = pytest.importorskip("nacre.viewer")
FRAMES = 6
SURVEYS = ["las", "laz", "copc.laz", "e57"]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small reconstruction whose fourth image is of nothing."""
    folder = tmp_path_factory.mktemp("viewer")
    mesh = nacre.built_in_object()
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    poses = nacre.turntable_poses(mesh, FRAMES, math.radians(8), camera=camera, distance=0.45)
    depths = [mesh.simulate_depth(camera, pose, noise=0.0005, seed=i) for i, pose in enumerate(poses)]
    depths[3] = np.full_like(depths[3], np.nan)
    nacre.write_recording(folder / "ball", camera, depths, depth_scale=5000, poses=poses)
    arguments = ["reconstruct", str(folder / "ball"), "-o", str(folder / "out"), "--quiet"]
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert not end.value.code
    return folder / "out"


def snapshot(n: int = 50) -> viewer.Snapshot:
    points = np.random.default_rng(0).normal(size=(n, 3)).astype(np.float32)
    normals = (points / np.linalg.norm(points, axis=1, keepdims=True)).astype(np.float32)
    return viewer.Snapshot(points, normals, 0.1, confidence=np.arange(1.0, n + 1))


class TestTimeline:
    def test_snapshots_stay_few_and_evenly_spread(self) -> None:
        timeline = viewer.Timeline("x", None, max_snapshots=8)
        for i in range(100):
            timeline.add(ReportedFrame(i, "TRACKED"))
            timeline.set_snapshot(snapshot())
        places = [place for place, _ in timeline.snapshots]
        assert len(places) <= 8
        assert places[-1] == 99
        assert places[0] == 0

    def test_older_states_keep_fewer_points(self) -> None:
        timeline = viewer.Timeline("x", None, max_points=20)
        for i in range(3):
            timeline.add(ReportedFrame(i, "TRACKED"))
            timeline.set_snapshot(snapshot(50))
        assert [len(cloud.points) for _, cloud in timeline.snapshots] == [17, 17, 50]
        thin = timeline.snapshots[0][1]
        assert thin.confidence is not None
        assert len(thin.normals) == len(thin.confidence) == 17
        assert thin.spacing == pytest.approx(0.1 * 3**0.5)

    def test_too_few_snapshots_are_refused(self) -> None:
        with pytest.raises(ValueError, match="max_snapshots must be at least 2, got 1"):
            viewer.Timeline("x", None, max_snapshots=1)

    def test_what_was_written_is_told(self, out: Path) -> None:
        timeline = viewer.read_timeline(out)
        assert not viewer.read_timeline(out / "model.ply").is_upright
        assert [frame.status for frame in timeline.frames].count("LOST") == 1
        assert timeline.frames[3].reason
        assert words(timeline.frames[0])["overlap"] == "100 %"
        first, last = timeline.frames[0], timeline.frames[-1]
        assert last.truth is not None
        assert last.world_from_camera is not None
        assert np.allclose(first.truth, np.eye(4))
        assert np.abs(last.truth - last.world_from_camera).max() < 0.01
        (cloud,) = (cloud for _, cloud in timeline.snapshots)
        assert cloud.sigma is not None
        assert 0 < np.min(cloud.sigma) < np.max(cloud.sigma) < 0.01
        assert timeline.depth_of is not None
        assert timeline.depth_of(2).shape == (120, 160)


@pytest.mark.parametrize(
    ("reason", "told"),
    [
        ("registration score 0.03 is below 0.36: overlap 0.5", "it does not fit the model well enough"),
        ("1 direction(s) of the pose are not determined", "the shape leaves directions of the pose open"),
        ("no overlap", "no overlap"),
        ("", ""),
    ],
)
def test_reasons_are_told_plainly(reason: str, told: str) -> None:
    assert plain_reason(reason) == told


def test_removed_pixels_are_marked() -> None:
    from nacre.viewer.depth_picture import depth_picture

    depth = np.full((60, 80), 0.5, np.float32)
    depth[20:40, 30:50] = 0.3
    picture = depth_picture(depth, nacre.Camera(80, 60, 70, 70, 39.5, 29.5))
    colors = {tuple(color) for color in picture.reshape(-1, 3).tolist()}
    assert picture.shape == (60, 80, 3)
    assert len(colors) >= 3


def test_a_run_is_shown_while_it_grows(out: Path) -> None:
    sequence = nacre.open_sequence(out.parent / "ball")
    done = Reconstruction(sequence, nacre.Model(sequence.camera))
    live = viewer.LiveView(done, "ball", port=0)
    try:
        for record in done.run():
            live.add(record)
            live.show()
        assert live.timeline.is_growing
        first, last = (live.timeline.snapshots[i][1] for i in (0, -1))
        assert len(first.points) < len(last.points)
        live.finish()
        assert not live.timeline.is_growing
        frames = json.loads(live.viewer.data.document)["runs"][0]["frames"]
        assert len(frames) == FRAMES
        assert len(live.timeline.snapshots) == FRAMES
    finally:
        live.viewer.close()


def test_nothing_to_export_is_an_error(tmp_path: Path) -> None:
    empty, known = viewer.Timeline("x", None), two_looks(plane())
    with pytest.raises(ValueError, match="timeline must hold a state of the model"):
        viewer.export_html(empty, tmp_path / "x.html")
    with pytest.raises(ValueError, match="other must hold a state of the model"):
        viewer.export_html(known, tmp_path / "x.html", other=empty)
    with pytest.raises(ValueError, match="other must hold a state of the model"):
        viewer.Viewer(known, other=empty, port=0)
    assert not list(tmp_path.iterdir())


def run(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return int(end.value.code or 0)


def embedded(page: Path) -> bytes:
    """Return the data in an exported page."""
    (found,) = re.findall(r'<script id="data" type="text/plain">(.+?)</script>', page.read_text())
    return gzip.decompress(base64.b64decode(found))


def test_the_command_line_writes_pages(out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "view.html"
    assert run("view", out, "--html", page) == 0
    assert str(page) in capsys.readouterr().out
    assert b'"deviation"' not in embedded(page)
    assert run("view", out, "--compare", out, "--html", page) == 0
    assert b'"deviation"' in embedded(page)
    addresses = set(re.findall(r"https?://[^\"]+", page.read_text()))
    assert all(address.startswith("http://www.w3.org/") for address in addresses)  # names, never fetched


def test_a_run_to_compare_with_that_is_missing(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("view", out, "--compare", tmp_path, "--html", tmp_path / "view.html") != 0
    assert "report.json" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_file_for_rerun_is_of_one_run(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("view", out, "--compare", out, "--rrd", tmp_path / "view.rrd") != 0
    assert "--rrd writes one run: leave out --compare" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_points_that_are_not_finite_are_left_out(out: Path, tmp_path: Path) -> None:
    shutil.copytree(out, tmp_path / "out")
    model = nacre.read_points(out / "model.ply")
    points = model.points.copy()
    points[:7] = np.nan
    nacre.write_points(tmp_path / "out" / "model.ply", points, normals=model.normals)
    (cloud,) = (cloud for _, cloud in viewer.read_timeline(tmp_path / "out").snapshots)
    assert len(cloud.points) == len(points) - 7
    viewer.export_html(viewer.read_timeline(tmp_path / "out"), tmp_path / "view.html")


def test_a_point_file_is_shown_too(tmp_path: Path) -> None:
    cloud = plane()
    nacre.write_points(tmp_path / "scan.ply", cloud.points)
    timeline = viewer.read_timeline(tmp_path / "scan.ply")
    (read,) = (cloud for _, cloud in timeline.snapshots)
    assert timeline.title == "scan.ply"
    assert read.spacing == pytest.approx(cloud.spacing, rel=1e-4)
    np.testing.assert_allclose(read.normals, -cloud.normals, atol=1e-4)  # towards who looks, along -z
    assert timeline.is_upright
    assert run("view", tmp_path / "scan.ply", "--html", tmp_path / "view.html", "--quiet") == 0
    assert b'"frames": []' in embedded(tmp_path / "view.html")


def test_a_mesh_file_keeps_its_triangles(tmp_path: Path) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], float)
    nacre.write_mesh(tmp_path / "mesh.ply", vertices, [[0, 1, 2]])
    ((_, read),) = viewer.read_timeline(tmp_path / "mesh.ply").snapshots
    assert read.triangles is not None
    assert read.triangles.tolist() == [[0, 1, 2]]
    np.testing.assert_allclose(read.normals[:3], np.broadcast_to((0, 0, 1), (3, 3)))
    turned = read.rows(np.array([2, 3, 0, 1]), 1.0)
    assert turned.triangles is not None
    assert turned.triangles.tolist() == [[2, 3, 0]]
    less = read.rows(np.array([0, 1, 3]), 1.0)
    assert less.triangles is not None
    assert len(less.triangles) == 0
    assert read.thinned(2).triangles is None
    data = PageData([viewer.read_timeline(tmp_path / "mesh.ply")])
    assert data.surface_names == ["triangles/0/-1/4"]
    with pytest.raises(KeyError):
        data.read("holes/0/-1/4")


@pytest.mark.parametrize("ending", ["glb", "obj", "stl"])
def test_meshes_of_other_formats_are_shown(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"mesh.{ending}"
    nacre.write_mesh(path, [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    ((_, read),) = viewer.read_timeline(path).snapshots
    assert read.triangles is not None
    assert read.points[read.triangles[0]].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    np.testing.assert_allclose(read.normals, np.broadcast_to((0, 0, 1), (3, 3)))


@pytest.mark.parametrize("ending", ["glb", "obj", "ply", "stl"])
def test_a_mesh_file_of_nacre_stands_upright(tmp_path: Path, ending: str) -> None:
    path, corners, triangles = tmp_path / f"a.{ending}", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
    for comments in ([], ["nacre 0.1.0", "metres; the world is the first camera's frame"]):
        nacre.write_mesh(path, corners, triangles, comments=comments)
        assert viewer.read_timeline(path).is_upright == (not comments)


@pytest.mark.parametrize("ending", SURVEYS)
def test_z_is_up_in_surveys_but_not_where_the_file_says_otherwise(tmp_path: Path, ending: str) -> None:
    pytest.importorskip("pye57" if ending == "e57" else "laspy")
    path, cloud = tmp_path / f"a.{ending}", plane()
    nacre.write_points(path, cloud.points, normals=cloud.normals)
    assert viewer.read_timeline(path).is_survey
    np.testing.assert_allclose(opening(path).up, (0, 0, 1))
    of_nacre = "metres; the world is the first camera's frame"
    nacre.write_points(path, cloud.points, normals=cloud.normals, comments=[of_nacre])
    np.testing.assert_allclose(opening(path).up, (0, -1, 0), atol=1e-6)
    told = View(np.array([0, 0, 1.0]), np.array([0, 0, -1.0]), np.array([1.0, 0, 0]), 0.2)
    moved = told._replace(target=told.target + 5000)
    nacre.write_points(path, cloud.points + 5000, normals=cloud.normals, comments=[moved.as_comment()])
    timeline = viewer.read_timeline(path)
    view = opening(path)
    np.testing.assert_allclose(view.up, told.up)
    np.testing.assert_allclose(view.target + timeline.origin, moved.target, atol=0.01)


def opening(path: Path) -> View:
    timeline = viewer.read_timeline(path)
    place, cloud = timeline.snapshots[-1]
    return first_view(cloud, timeline, place)


@pytest.mark.parametrize("ending", ["glb", "obj", "ply"])
def test_a_mesh_of_a_run_opens_as_the_run_does(out: Path, tmp_path: Path, ending: str) -> None:
    assert run("mesh", out, "-o", tmp_path / f"a.{ending}", "--quiet") == 0
    assert run("convert", tmp_path / f"a.{ending}", tmp_path / "b.ply", "--quiet") == 0
    for path in (out / "model.ply", tmp_path / f"a.{ending}", tmp_path / "b.ply"):
        for expected, value in zip(opening(out), opening(path), strict=True):
            np.testing.assert_allclose(value, expected, atol=1e-5)


@pytest.mark.parametrize("ending", SURVEYS)
def test_the_points_of_a_run_open_as_the_run_does_in_formats_of_surveys(
    out: Path, tmp_path: Path, ending: str
) -> None:
    pytest.importorskip("pye57" if ending == "e57" else "laspy")
    path = tmp_path / f"a.{ending}"
    assert run("convert", out / "model.ply", path, "--quiet") == 0
    view, timeline = opening(path), viewer.read_timeline(path)
    moved = view._replace(target=view.target + timeline.origin)
    for expected, value in zip(opening(out), moved, strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-5)


def painted_plane(path: Path) -> Path:
    """Write the plane as two triangles, painted red on the left and blue on the right."""
    image = np.zeros((64, 64, 3), np.uint8)
    image[:, :32, 0] = image[:, 32:, 2] = 255
    uv = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    vertices = np.column_stack([0.2 * uv - 0.1, np.full(4, 0.5)])
    triangles = np.array([[0, 2, 1], [1, 2, 3]], np.int32)
    nacre.write_mesh(path, vertices, triangles, texture=Texture(image, uv, triangles))
    return path


@pytest.mark.parametrize("ending", ["glb", "obj"])
def test_the_page_gets_the_image_of_a_painted_mesh(tmp_path: Path, ending: str) -> None:
    timeline = viewer.read_timeline(painted_plane(tmp_path / f"a.{ending}"))
    ((_, read),) = timeline.snapshots
    data = PageData([timeline])
    (name,) = (name for name in data.surface_names if name.startswith("image/"))
    assert data.read(name) == read.painting.image
    assert read.painting.image.startswith(b"\xff\xd8\xff")
    assert b'"uvStep"' in data.read(name.replace("image", "points"))
    left = read.points[:, 0] < 0
    assert np.abs(read.colors[left] - [255.0, 0, 0]).max() < 9  # what is painted at the vertices
    assert np.abs(read.colors[~left] - [0, 0, 255.0]).max() < 9
    assert read.thinned(2).painting is None
    assert read.thinned(2).colors is not None


def test_a_mesh_keeps_its_triangles_and_its_image_where_points_alone_are_thinned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.page_data.MAX_POINTS", 2)
    data = PageData([viewer.read_timeline(painted_plane(tmp_path / "a.glb"))])
    assert data.surface_names == ["triangles/0/-1/4", "image/0/-1/4"]
    assert b'"rows": 4' in data.read("points/0/-1/4")
    assert b'"rows": 2' in data.read("triangles/0/-1/4")
    monkeypatch.setattr("nacre.viewer.page_data.MAX_VERTICES", 3)
    few = PageData([viewer.read_timeline(tmp_path / "a.glb")])
    assert few.surface_names == ["triangles/0/-1/4"]
    assert b'"uv"' not in few.read("points/0/-1/4")
    viewer.export_html(viewer.read_timeline(tmp_path / "a.glb"), tmp_path / "view.html")
    assert b'"rows": 2' in embedded(tmp_path / "view.html")


def test_a_run_shows_its_painted_mesh(out: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(out, tmp_path / "out")
    assert json.loads(PageData([viewer.read_timeline(folder)]).document)["runs"][0]["painted"] is None
    painted_plane(folder / "mesh.glb")
    timeline = viewer.read_timeline(folder)
    data = PageData([timeline])
    name = json.loads(data.document)["runs"][0]["painted"]
    assert {f"{kind}/{name}" for kind in ("points", "triangles", "image")} <= set(data.surface_names)
    assert all(data.read(wanted) for wanted in data.surface_names)
    assert name not in {state["name"] for state in json.loads(data.document)["runs"][0]["states"]}
    compared = json.loads(PageData([timeline, timeline]).document)["runs"]
    assert [run["painted"] for run in compared] == [None, None]  # two runs by their points


def test_a_mesh_whose_texture_is_damaged_is_shown_without(tmp_path: Path) -> None:
    path = painted_plane(tmp_path / "a.glb")
    data = path.read_bytes()
    start = data.index(b"\xff\xd8\xff")
    path.write_bytes(data[: start + 20] + bytes(len(data) - start - 20))
    with pytest.warns(UserWarning, match=r"the texture is left out: .*a\.glb"):
        ((_, read),) = viewer.read_timeline(path).snapshots
    assert (read.painting, read.colors) == (None, None)
    assert len(read.triangles) == 2


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.mtl", None, r"a\.mtl: it cannot be read: No such file"),
        ("a_texture.jpg", None, r"a_texture\.jpg: it cannot be read: No such file"),
        ("a_texture.jpg", b"\xff\xd8\xff damaged", r"a\.obj: .*image"),
        ("a.mtl", b"1 2 3", r"a\.mtl, line 1: cannot read '1 2 3'"),
    ],
)
def test_an_obj_file_whose_texture_is_missing_or_damaged_is_shown_without(
    tmp_path: Path, name: str, content: bytes | None, said: str
) -> None:
    path = painted_plane(tmp_path / "a.obj")
    (tmp_path / name).unlink()
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.warns(UserWarning, match=f"the texture is left out: .*{said}"):
        ((_, read),) = viewer.read_timeline(path).snapshots
    assert (read.painting, read.colors) == (None, None)
    assert len(read.points) == 4
    assert len(read.triangles) == 2


def test_faces_that_are_no_triangles_leave_the_points(tmp_path: Path) -> None:
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    lines += ["0 0 0", "1 0 0", "0 1 0", "2 0 1"]
    (tmp_path / "edge.ply").write_text("\n".join(lines) + "\n")
    ((_, read),) = viewer.read_timeline(tmp_path / "edge.ply").snapshots
    assert len(read.points) == 3
    assert read.triangles is None


def test_uncertainties_that_are_not_known_are_the_largest() -> None:
    def column(*sigma: float) -> bytes:
        timeline = viewer.Timeline("x", None)
        timeline.set_snapshot(replace(snapshot(4), sigma=np.array(sigma)))
        return PageData([timeline]).read("points/0/-1/4")

    assert column(0.01, 0.02, np.nan, 0.03) == column(0.01, 0.02, 0.03, 0.03)
    assert b'"sigma"' in column(0.01, 0.02, np.nan, 0.03)
    assert b'"sigma"' not in column(np.nan, np.nan, np.nan, np.nan)


def test_a_file_of_no_points_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scan.ply").write_bytes(b"solid")
    assert run("view", tmp_path / "scan.ply", "--html", tmp_path / "view.html") != 0
    assert "scan.ply" in capsys.readouterr().err
    nacre.write_points(tmp_path / "none.ply", np.zeros((0, 3)))
    assert run("view", tmp_path / "none.ply", "--html", tmp_path / "view.html") != 0
    assert "timeline must hold a state of the model to export" in capsys.readouterr().err
    assert not (tmp_path / "view.html").exists()


def test_the_report_tells_the_viewer_what_it_needs(out: Path) -> None:
    report = json.loads((out / "report.json").read_text())
    assert report["recording"]["camera"]["model"] == "pinhole"
    assert "last_seen" in nacre.read_points(out / "model.ply").attributes
