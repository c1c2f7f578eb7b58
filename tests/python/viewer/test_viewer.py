"""The viewer: what it tells, and that a real browser draws it and obeys its controls."""

from __future__ import annotations

import io
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.reconstruction import Reconstruction
from nacre.report import ReportedFrame
from nacre.viewer.timeline import words

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import CHROMIUM, Browser

viewer = pytest.importorskip("nacre.viewer")
pytest.importorskip("viser")

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
FRAMES = 6


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


class TestStory:
    def test_snapshots_stay_few_and_evenly_spread(self) -> None:
        timeline = viewer.Timeline("x", None, max_snapshots=8)
        for i in range(100):
            timeline.add(ReportedFrame(i, "TRACKED"))
            timeline.set_snapshot(snapshot())
        places = [place for place, _ in timeline.snapshots]
        assert len(places) <= 8
        assert places[-1] == 99
        assert places[0] == 0
        assert timeline.snapshot_at(0) is timeline.snapshots[0][1]
        assert timeline.snapshot_at(99) is timeline.snapshots[-1][1]

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

    def test_a_lost_frame_is_drawn_where_the_camera_was_last_known(self) -> None:
        timeline = viewer.Timeline("x", None)
        pose = np.eye(4)
        pose[0, 3] = 2
        timeline.add(ReportedFrame(0, "TRACKED", world_from_camera=pose))
        timeline.add(ReportedFrame(1, "LOST"))
        assert timeline.pose_at(1) is pose

    def test_too_few_snapshots_are_refused(self) -> None:
        with pytest.raises(ValueError, match="max_snapshots must be at least 2, got 1"):
            viewer.Timeline("x", None, max_snapshots=1)

    def test_what_was_written_is_told(self, out: Path) -> None:
        timeline = viewer.read_timeline(out)
        assert [frame.status for frame in timeline.frames].count("LOST") == 1
        assert timeline.frames[3].reason
        assert words(timeline.frames[0])["overlap"] == "100 %"
        first, last = timeline.frames[0], timeline.frames[-1]
        assert last.truth is not None
        assert last.world_from_camera is not None
        assert np.allclose(first.truth, np.eye(4))
        assert np.abs(last.truth - last.world_from_camera).max() < 0.01
        assert timeline.depth_of is not None
        assert timeline.depth_of(2).shape == (120, 160)


class TestColors:
    @pytest.mark.parametrize("kind", ["colour", "shading", "normal", "confidence", "age"])
    def test_every_point_has_one(self, kind: str) -> None:
        from nacre.viewer.colors import point_colors

        colors = point_colors(snapshot(), kind)
        assert colors.shape == (50, 3)
        assert colors.dtype == np.uint8

    def test_confident_points_are_lighter(self) -> None:
        from nacre.viewer.colors import point_colors

        colors = point_colors(snapshot(), "confidence").astype(int).sum(axis=1)
        assert colors[-1] > colors[0]

    def test_the_ends_of_the_colours_are_told(self) -> None:
        from nacre.viewer.page import color_bar

        assert "2.0" in color_bar(snapshot(), "confidence")
        assert "49 observations" in color_bar(snapshot(), "confidence")
        assert "green: up" in color_bar(snapshot(), "normal")

    def test_the_view_begins_at_what_is_best_known(self) -> None:
        from nacre.viewer.scene import core, extent

        far = snapshot(400)
        near = 0.1 * far.points[:100]
        cloud = viewer.Snapshot(
            np.concatenate([near, far.points[100:]]),
            far.normals,
            0.1,
            confidence=np.r_[np.full(100, 9.0), np.ones(300)],
        )
        np.testing.assert_array_equal(core(cloud), near)
        assert extent(cloud) < 0.2 * extent(far)

    def test_removed_pixels_are_marked(self) -> None:
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
        first, last = (live.timeline.snapshots[i][1] for i in (0, -1))
        assert len(first.points) < len(last.points)
        live.finish()
        assert live.viewer.place == FRAMES - 1
        assert len(live.timeline.snapshots) == FRAMES
    finally:
        live.viewer.close()


def test_what_a_frame_does_not_have_is_not_left_from_another(out: Path) -> None:
    page = viewer.Viewer(viewer.read_timeline(out), port=0)
    try:
        assert "/path" in page._scene._drawn
        page._scene.show_cameras(page.timeline, 0, 0.02)  # one camera makes no path
        assert "/path" not in page._scene._drawn
        assert "/camera" in page._scene._drawn
    finally:
        page.close()


def test_nothing_to_export_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="timeline must hold a state of the model"):
        viewer.export_html(viewer.Timeline("x", None), tmp_path / "x.html")
    assert not list(tmp_path.iterdir())


def bright_part(png: bytes) -> float:
    """Return which part of the page's left, where the scene is, is lighter than its background."""
    from PIL import Image

    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("L"), dtype=float)
    scene = pixels[150:, : int(0.7 * pixels.shape[1])]
    return float((scene > 80).mean())


@needs_browser
@pytest.mark.slow
def test_a_browser_draws_the_model_and_a_control_is_obeyed(out: Path, tmp_path: Path) -> None:
    page = viewer.Viewer(viewer.read_timeline(out), port=0)
    try:
        with Browser(tmp_path / "profile") as browser:
            browser.open(page.url)
            browser.wait_for("document.body.innerText.includes('frame 5, TRACKED')")
            for _ in range(40):
                picture = browser.screenshot()
                if bright_part(picture) > 0.02:
                    break
            (out.parent / "viewer.png").write_bytes(picture)
            assert bright_part(picture) > 0.02
            browser.evaluate("document.querySelector('[role=slider]').focus()")
            browser.press("ArrowLeft", 37)
            browser.wait_for("document.body.innerText.includes('frame 4, RELOCALISED')")
            browser.press("ArrowLeft", 37)
            browser.wait_for("document.body.innerText.includes('frame 3, LOST')")
            assert page.place == 3
    finally:
        page.close()


@needs_browser
@pytest.mark.slow
def test_the_exported_page_opens_from_disk(out: Path, tmp_path: Path) -> None:
    viewer.export_html(viewer.read_timeline(out), tmp_path / "view.html")
    text = (tmp_path / "view.html").read_text()
    assert "__VISER_EMBED_DATA__" in text
    with Browser(tmp_path / "profile") as browser:
        browser.open((tmp_path / "view.html").as_uri())
        for _ in range(60):
            picture = browser.screenshot()
            if bright_part(picture) > 0.02:
                return
    raise AssertionError("nothing was drawn")


def test_the_report_tells_the_viewer_what_it_needs(out: Path) -> None:
    report = json.loads((out / "report.json").read_text())
    assert report["recording"]["camera"]["model"] == "pinhole"
    assert "last_seen" in nacre.read_points(out / "model.ply").attributes
