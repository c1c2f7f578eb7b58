"""The report: charts, numbers as people read them, and a page that stands alone."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nacre import Camera, DepthCalibration
from nacre.evaluation import Completeness, SurfaceAccuracy, absolute_trajectory_error
from nacre.pictures.colormap import viridis
from nacre.report import (
    DepthExample,
    ModelCloud,
    ReportData,
    ReportedFrame,
    pictures,
    render_page,
    write_report,
)
from nacre.report.charts import MAX_VALUES, Mark, Series, grouped, line_chart, map_chart, stacked_chart
from nacre.report.depth_pictures import draw_depth
from nacre.report.first_view import disk_radii, first_view
from nacre.report.pictures import draw_model
from nacre.run_data.text import flatten, label, quantity, ranges, ticks

SPACE = "\N{NARROW NO-BREAK SPACE}"


def sphere(count: int = 6000, radius: float = 0.1) -> np.ndarray:
    """A Fibonacci lattice: evenly spread, the same everywhere."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    angle = np.pi * (1 + 5**0.5) * i
    rim = np.sqrt(1 - z**2)
    return radius * np.column_stack([rim * np.cos(angle), rim * np.sin(angle), z])


class TestCharts:
    @given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 8))
    def test_ticks_are_few_even_and_inside(self, low: float, span: float, count: int) -> None:
        places = ticks(low, low + span, count)
        assert len(places) <= count + 1
        tolerance = 1e-6 * span + 1e-9 * abs(low)
        assert all(low - tolerance <= place <= low + span + tolerance for place in places)
        if len(places) > 2:
            np.testing.assert_allclose(np.diff(places), places[1] - places[0], rtol=1e-3)

    @settings(max_examples=30, deadline=None)
    @given(st.integers(0, 3 * MAX_VALUES), st.integers(0, 9))
    def test_groups_keep_the_extremes(self, count: int, seed: int) -> None:
        values = np.random.default_rng(seed).normal(size=count)
        low, mean, high = grouped(values)
        assert len(low) == len(mean) == len(high) <= MAX_VALUES
        if count:
            assert low.min() == values.min()
            assert high.max() == values.max()
            assert (low <= mean + 1e-12).all()
            assert (mean <= high + 1e-12).all()

    def test_missing_values_leave_a_gap(self) -> None:
        svg = line_chart([Series("", np.array([1.0, 2.0, np.nan, 3.0]))], y_label="m")
        (path,) = re.findall(r'class="line s0" d="([^"]*)"', svg)
        assert path.count("M") == 2
        assert path.count("L") == 1
        assert "nan" not in svg

    def test_bars_reach_the_sum(self) -> None:
        svg = stacked_chart([Series("a", np.array([1.0])), Series("b", np.array([3.0]), 1)], y_label="ms")
        bars = re.findall(r"M[\d.]+ ([\d.]+)V([\d.]+)h", svg)
        (bottom_a, top_a), (bottom_b, top_b) = ((float(a), float(b)) for a, b in bars)
        assert top_a == bottom_b
        assert bottom_b - top_b == pytest.approx(3 * (bottom_a - top_a), abs=0.3)

    def test_maps_have_equal_scales(self) -> None:
        track = np.array([[0, 0], [1, 0], [1, 1.0]])
        for y_up in (True, False):
            svg = map_chart([("t", track, 0)], x_label="x", y_label="y", y_up=y_up, unit="m", factor=1)
            (path,) = re.findall(r'class="line s0" d="([^"]*)"', svg)
            xy = np.array(re.findall(r"([\d.]+) ([\d.]+)", path), dtype=float)
            along, across = xy[1] - xy[0], xy[2] - xy[1]
            assert along[1] == across[0] == 0
            assert along[0] == pytest.approx(-across[1] if y_up else across[1], abs=0.2)

    def test_names_and_marks(self) -> None:
        svg = line_chart(
            [Series("<b>", np.ones(5))], y_label="a<b", marks=[Mark(1, 2, "lost")], indices=[3, 4, 5, 6, 7]
        )
        assert 'class="lost"' in svg
        assert "<b>" not in svg
        assert "frame 7" in svg

    @pytest.mark.parametrize(
        "values", [np.zeros(0), np.zeros(3), np.full(3, np.nan), np.array([1e-300]), np.ones(1)]
    )
    def test_hardly_anything_to_draw(self, values: np.ndarray) -> None:
        for svg in (
            line_chart([Series("", values)], y_label="m"),
            stacked_chart([Series("", values)], y_label="m"),
            map_chart(
                [("t", np.stack([values, values], 1), 0)],
                x_label="x",
                y_label="y",
                y_up=True,
                unit="m",
                factor=1,
            ),
        ):
            assert svg.startswith("<svg")
            assert "nan" not in svg.lower()
            assert "inf" not in svg.lower()

    def test_colors_are_ordered_by_brightness(self) -> None:
        colors = viridis(np.linspace(-1, 2, 40)).astype(float)
        brightness = colors @ [0.2126, 0.7152, 0.0722]
        assert (np.diff(brightness) >= -0.5).all()
        assert colors[0].tolist() == [68, 1, 84]
        assert colors[-1].tolist() == [253, 231, 37]


class TestText:
    @pytest.mark.parametrize(
        ("value", "unit", "expected"),
        [
            (0.00010312, "m", "0.103 mm"),
            (0.0123, "m", "12.3 mm"),
            (-0.0123, "m", "\N{MINUS SIGN}12.3 mm"),
            (1.5, "m", "1.50 m"),
            (4.25, "m", "4.25 m"),
            (0.0, "m", "0 mm"),
            (2e-6, "m", "2.00 µm"),
            (math.radians(0.07), "rad", "0.0700\N{DEGREE SIGN}"),
            (0.99999, "fraction", "99.9 %"),
            (1.0, "fraction", "100 %"),
            (1e-9, "fraction", "0.1 %"),
            (20412, "count", f"20{SPACE}412"),
            (41.27, "ms", "41.3 ms"),
            (3348.2, "ms", "3.35 s"),
            (-12345.6, "", f"\N{MINUS SIGN}12{SPACE}346"),
            (1234, "number", f"1{SPACE}234"),
            (None, "m", "\N{EN DASH}"),
            (math.nan, "m", "\N{EN DASH}"),
            (np.float32(0.5), "", "0.500"),
            ("seconds", "", "seconds"),
            ((0.001, 0.002), "m", "1.00 mm, 2.00 mm"),
        ],
    )
    def test_quantities(self, value: Any, unit: str, expected: str) -> None:
        assert quantity(value, unit) == expected

    def test_ranges_of_frames(self) -> None:
        assert ranges([3]) == "frame 3"
        assert ranges([5, 4, 9]) == "frames 4 to 5, 9"
        assert ranges([*range(10, 20), 30, 32, 34, 36, 38]) == "frames 10 to 19, 30, 32, 34 and 2 more"

    def test_names(self) -> None:
        assert label("num_points") == "Points"
        assert label("rotation_rmse") == "Rotation RMSE"

    def test_parameters_of_any_depth(self) -> None:
        rows = flatten(
            {
                "preset": "default",
                "depth": {"max": 0.1, "noise": None},
                "k": 16,
                "frame": DepthCalibration(0.01, 0.001, 7),
            }
        )
        assert rows[:4] == [("preset", "default"), ("depth.max", "0.1"), ("depth.noise", "None"), ("k", "16")]
        assert ("frame.num_pairs", "7") in rows


class PageCheck(HTMLParser):
    """Collects what a browser would open, and that every tag is closed."""

    EMPTY = ("meta", "img", "br", "i")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.links: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attributes if name in ("src", "href", "xlink:href")]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def entries(count: int, lost: tuple[int, ...] = ()) -> list[ReportedFrame]:
    world = np.eye(4)
    world[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    world[:3, 3] = [5, 6, 7]
    frames = []
    for i in range(count):
        truth, estimated = np.eye(4), np.eye(4)
        truth[:3, 3] = [math.sin(0.1 * i), 0.1 * math.cos(0.37 * i), 1 - math.cos(0.1 * i)]
        estimated[:3, 3] = truth[:3, 3] + [0, 0.003 * (-1) ** i, 0]
        frames.append(
            ReportedFrame(
                index=i,
                status="LOST" if i in lost else "TRACKED",
                reason="<overlap>" if i in lost else "",
                milliseconds={"preprocess": 2.0, "registration": 8.0 + i % 3, "total": 12.0 + i % 3},
                num_inliers=1000 + i,
                overlap=0.8,
                rmse=0.0004,
                world_from_camera=None if i in lost else estimated,
                truth=world @ truth,
                num_points=100 * i,
                removed={"edge": 500, "slanted": 20},
            )
        )
    return frames


def example_data(**changes: Any) -> ReportData:
    points = sphere(3000)
    depth = np.full((12, 16), 0.8)
    depth[2:5, 3:9] = 0.5
    after = depth.copy()
    after[5, :] = np.nan
    fields: dict[str, Any] = {
        "title": "Ball <script>alert(1)</script> & more",
        "source": 'a "made-up" recording',
        "frames": entries(12, lost=(7,)),
        "model": ModelCloud(points, points, np.full((3000, 3), 120, np.uint8), np.arange(3000.0)),
        "depth": [DepthExample(depth, after, np.isnan(after).astype(int), ("edge",), 3)],
        "evaluation": {
            "Surface": SurfaceAccuracy(1.2e-4, 1e-4, 1e-4, 3e-4, 5e-4, -1e-5, 3000, np.zeros(3000)),
            "Cover": Completeness((0.001, 0.002, 0.005), (0.5, 0.75, 1.0), 1e-3, 2e-3, 3e-3, 1000),
        },
        "figures": {"peak memory": "211 <MB>"},
        "parameters": {"preset": "default", "depth": {"max_depth": math.inf}},
    }
    return ReportData(**{**fields, **changes})


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("_SIZE", "_MAIN_SIZE", "_CAMERA_SIZE"):
            patch.setattr(pictures, name, (150, 150))
        yield


@pytest.fixture(scope="module")
def page() -> str:
    return render_page(example_data())


class TestPage:
    def test_it_stands_alone(self, page: str) -> None:
        check = PageCheck(page)
        assert all(link.startswith(("data:image/webp;base64,", "#")) for link in check.links)
        assert not {"script", "link", "iframe", "object"} & set(check.tags)
        assert not re.search(r"https?://|url\(|@import", page)

    def test_all_but_the_verdict_main_figures_and_views_is_folded(self, page: str) -> None:
        names = re.findall(r'<details class="section[^>]*><summary>.*?</summary>\s*<div id="(\w+)"', page)
        assert {"look", "model", "depth", "trajectory", "frames", "time", "figures"} <= set(names)
        shown = re.sub(r"<details.*?</details>", "", page, flags=re.DOTALL)
        assert shown.count("<img") == 4
        assert "<table" not in shown

    def test_those_who_do_not_see_it_are_told(self, page: str) -> None:
        assert all(len(alt) > 10 for alt in re.findall(r'<img [^>]*alt="([^"]*)"', page))
        assert 'aria-label="Status of every frame: 11 TRACKED, 1 LOST; lost: frame 7"' in page
        assert re.search(r'aria-label="position \[mm\] of every frame; [^"]*greatest', page)

    def test_it_prints_light_and_without_what_only_a_screen_can_use(self, page: str) -> None:
        style = page[page.index("<style>") : page.index("</style>")]
        screen, printed = style.split("@media print")
        assert "@media screen and (prefers-color-scheme: dark)" in screen
        assert "size: A4" in printed
        assert re.search(r"details\.screen[^}]*display: none", printed)
        assert "print-color-adjust: exact" in printed

    def test_text_is_escaped(self, page: str) -> None:
        check = PageCheck(page)
        for told in (
            "Ball <script>alert(1)</script> & more",
            'a "made-up" recording',
            "211 <MB>",
            "<overlap>",
        ):
            assert told in check.text

    def test_it_says_the_main_figures_first(self, page: str) -> None:
        text = PageCheck(page).text
        verdict, shown = text[: text.index("Frames tracked")], text[: text.index("Frames not fused")]
        assert "Incomplete: 1 of 12 frames was lost: <overlap> (frame 7)." in verdict
        for figure in ("11 / 12", f"3{SPACE}000", "0.120 mm", "RMSE over 11 of 12 frames", "13.0 ms"):
            assert figure in shown
        assert "75.0 %" in text
        assert "max_depth" in text

    def test_errors_come_from_the_poses_unless_they_are_given(self) -> None:
        frames = entries(10)
        poses, truth = (
            np.stack([getattr(f, name) for f in frames]) for name in ("world_from_camera", "truth")
        )
        given = absolute_trajectory_error(poses, truth, align="first")
        told = quantity(given.rmse, "m")
        assert told not in PageCheck(render_page(ReportData("x", frames=frames))).text
        assert told in PageCheck(render_page(ReportData("x", frames=frames, evaluation={"ATE": given}))).text

    def test_it_has_2_mb_at_most_however_long_the_recording_and_large_the_model(self) -> None:
        random = np.random.default_rng(0)
        points, normals = random.uniform(-1, 1, (60_000, 3)), random.normal(size=(60_000, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        colors = random.integers(0, 256, (60_000, 3), dtype=np.uint8)
        depth, reasons = random.uniform(0.3, 8, (480, 640)), random.integers(0, 4, (480, 640))
        names = ("edge", "slanted", "isolated")
        page = render_page(
            ReportData(
                "noise",
                frames=entries(5000, lost=tuple(range(0, 5000, 2))),
                model=ModelCloud(points, normals, colors, random.exponential(1, 60_000)),
                depth=2 * [DepthExample(depth, np.where(reasons > 0, np.nan, depth), reasons, names)],
            )
        )
        assert len(page.encode()) <= 2_000_000

    def test_lost_frames_are_marked(self, page: str) -> None:
        assert '<path class="lost"' in page
        assert 'class="verdict weak"' in page
        assert 'class="status-LOST"' in page
        tracked = render_page(ReportData("x", frames=entries(12)))
        assert '<path class="lost"' not in tracked
        assert 'class="verdict ok"' in tracked

    def test_loops_are_marked_and_named(self) -> None:
        frames = entries(12)
        frames[9] = ReportedFrame(**frames[9].figures | {"loop_frame": 2})
        page = render_page(ReportData("x", frames=frames))
        assert '<path class="loop"' in page
        assert "closes a loop with frame 2" in PageCheck(page).text
        assert "loop closed" not in PageCheck(render_page(ReportData("x", frames=entries(12)))).text

    def test_the_same_data_gives_the_same_bytes(self, page: str, tmp_path: Path) -> None:
        write_report(tmp_path / "report.html", example_data())
        assert (tmp_path / "report.html").read_bytes() == page.encode()
        assert [path.name for path in tmp_path.iterdir()] == ["report.html"]

    def test_long_recordings_stay_small(self) -> None:
        short = render_page(ReportData("x", frames=entries(12)))
        long = render_page(ReportData("x", frames=entries(2000, lost=tuple(range(0, 2000, 7)))))
        PageCheck(long)
        assert len(long) < 700_000
        assert len(short) < 100_000
        assert "means over 5 frames" in long

    @pytest.mark.parametrize(
        "data",
        [
            ReportData(""),
            ReportData("x", frames=[ReportedFrame(0, "TRACKED")]),
            ReportData("x", frames=[ReportedFrame(i, "LOST") for i in range(5)]),
            ReportData(
                "x",
                frames=[
                    ReportedFrame(0, "TRACKED", truth=np.eye(4)),
                    ReportedFrame(1, "lost", truth=np.eye(4)),
                ],
            ),
            ReportData("x", model=ModelCloud(np.zeros((0, 3)))),
            ReportData("x", model=ModelCloud(np.full((4, 3), np.nan), np.zeros((4, 3)))),
            ReportData("x", depth=[DepthExample(np.zeros((4, 5)), np.full((4, 5), np.nan))]),
            ReportData("x", parameters={"a": {}}, figures={"b": math.nan}),
        ],
    )
    def test_whatever_is_missing_is_left_out(self, data: ReportData) -> None:
        text = PageCheck(render_page(data)).text
        assert "nan" not in text.lower().replace("nacre", "")

    def test_a_folder_that_is_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError):
            write_report(tmp_path / "missing" / "report.html", ReportData("x"))


class TestPictures:
    def test_removed_pixels_are_counted_by_reason(self) -> None:
        before = np.full((6, 8), 1.0)
        before[0, 0] = np.nan
        after, reasons = before.copy(), np.zeros((6, 8), int)
        after[1, :], reasons[1, :] = np.nan, 1
        after[2, :3], reasons[2, :3] = np.nan, 2
        drawn = draw_depth(DepthExample(before, after, reasons, ("edge", "isolated")))
        assert [(name, count) for name, _, count in drawn.removed] == [("edge", 8), ("isolated", 3)]
        assert drawn.num_measured == 47
        without = draw_depth(DepthExample(before, after))
        assert [(name, count) for name, _, count in without.removed] == [("removed", 11)]

    def test_illegal_depth_is_named(self) -> None:
        with pytest.raises(ValueError, match=r"depth\.before and depth\.after"):
            draw_depth(DepthExample(np.ones((2, 2)), np.ones((2, 3))))
        with pytest.raises(ValueError, match=r"depth\.reasons"):
            draw_depth(DepthExample(np.ones((2, 2)), np.full((2, 2), np.nan), np.full((2, 2), 2), ("edge",)))

    def test_the_pictures_of_a_page_are_small(self) -> None:
        most = pictures._MAX_BYTES
        whole = most["main"] + 3 * most["camera"] + 6 * (most["side"] + most["attribute"]) + 9 * most["depth"]
        assert whole * 4 / 3 < 1_500_000  # base64

    def test_a_room_is_also_shown_from_its_cameras(self) -> None:
        ball = ModelCloud(sphere(3000), sphere(3000))
        room = ModelCloud(sphere(3000), -sphere(3000))
        frames = [ReportedFrame(i, "TRACKED", world_from_camera=np.eye(4)) for i in range(4)]
        outside, inside = draw_model(ball, frames), draw_model(room, frames)
        assert outside is not None
        assert inside is not None
        assert not outside.cameras
        assert [picture.caption for picture in inside.cameras] == [f"As frame {i} saw it" for i in (0, 2, 3)]
        assert all(picture.note == "" for picture in outside.sides)
        for frame in frames:  # poses relative to what bends are no places to look from
            frame.figures["deformation"] = {"num_nodes": 9, "strain": 0.1}
        bent = draw_model(room, frames)
        assert bent is not None
        assert not bent.cameras
        assert all(picture.note == "reverse sides left out" for picture in inside.sides)

    def test_the_first_picture_is_as_the_viewer_opens(self) -> None:
        ball = ModelCloud(sphere(3000) + np.array([0.3, 0, 1]), sphere(3000))
        camera = Camera(64, 48, 50, 50, 31.5, 23.5)
        aside = np.eye(4)
        aside[:3] = [[0, 0, -1, 1.3], [0, 1, 0, 0], [1, 0, 0, 1]]  # right of the ball, looks at it
        frames = [ReportedFrame(0, "TRACKED", world_from_camera=aside)]
        view = first_view(ball, frames, camera, (200, 100))
        eye = view.center - view.distance * view.view_from_model[2]
        np.testing.assert_allclose(eye[1:], (0, 1), atol=0.02)
        assert eye[0] > 0.5
        np.testing.assert_allclose(view.view_from_model[1], (0, 1, 0), atol=0.01)  # upright
        u, v, _ = view.project(ball.points).T
        assert np.abs(v).max() < 50
        assert np.ptp(v) == pytest.approx(np.ptp(u), rel=0.02)
        from_the_front = first_view(ball, (), None, (200, 100))
        np.testing.assert_allclose(from_the_front.view_from_model, np.eye(3), atol=1e-6)

    def test_disks_close_what_is_far(self) -> None:
        x, y = np.mgrid[0:30, 0:30].reshape(2, -1)
        near = np.column_stack([0.01 * x, 0.01 * y, np.ones(900)])
        far = np.column_stack([0.1 * x, 0.1 * y, np.full(900, 9)])[:600]
        points = np.concatenate([near, far])
        radii = disk_radii(ModelCloud(points, np.broadcast_to((0.0, 0, -1), points.shape)))
        assert np.median(radii[:900]) == pytest.approx(0.01, rel=1e-3)
        assert np.median(radii[900:]) == pytest.approx(0.1, rel=1e-3)

    def test_the_scale_bar_is_true(self) -> None:
        drawn = draw_model(ModelCloud(sphere(3000), sphere(3000)))
        assert drawn is not None
        text, part = drawn.scale_bar
        assert text == "50 mm"
        assert part == pytest.approx(0.05 / (0.2 / 0.92), rel=0.02)

    def test_attributes_of_another_length_are_named(self) -> None:
        with pytest.raises(ValueError, match=r"model\.confidence must have one row per point \(5\), got 4"):
            draw_model(ModelCloud(np.ones((5, 3)), confidence=np.ones(4)))
