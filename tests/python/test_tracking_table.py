"""The tracking table: goals, figures from written files, the page, what is eroded for peers."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(autouse=True, scope="module")
def _importable() -> Iterator[None]:
    sys.path.insert(0, str(BENCHMARKS))
    yield
    sys.path.remove(str(BENCHMARKS))


def test_goals_look_at_the_right_side() -> None:
    from track.rows import Goal

    assert Goal("ate", 12).is_reached({"ate": 12.0})
    assert not Goal("ate", 12).is_reached({"ate": 12.1})
    assert not Goal("ate", 12).is_reached({})
    assert not Goal("bias", 0.02, absolute=True).is_reached({"bias": -0.03})
    assert Goal("complete", 99, at_least=True).is_reached({"complete": 99.5})
    assert not Goal("tracked", 12, at_least=True).is_reached({"tracked": 11})


def test_figures_come_from_what_was_written(tmp_path: Path) -> None:
    from track.figures import collect

    statuses = ["TRACKED", "TRACKED", "WEAK", "LOST"]
    frames = [{"status": status} for status in statuses]
    report = {"frames": frames, "milliseconds": {"median": 4.0}}
    (tmp_path / "report.json").write_text(json.dumps(report))
    evaluation = {"pose_error": {"rotation_max": np.pi / 180, "translation_max": None}}
    figures = collect(evaluation, tmp_path, 1.5)
    assert figures["rotation"] == pytest.approx(1.0)
    assert "translation" not in figures
    assert [figures[name] for name in ("frames", "tracked", "weak", "lost")] == [4, 2, 1, 1]


def test_every_goal_names_a_figure_and_every_row_a_recording() -> None:
    from track.figures import BY_NAME
    from track.peers import TITLES
    from track.table import ROWS

    assert len({row.name for row in ROWS}) == len(ROWS)
    for row in ROWS:
        assert {goal.figure for goal in row.goals} <= set(BY_NAME), row.name
        assert row.recording is not None or row.measure is not None, row.name
        assert set(row.peers) <= set(TITLES), row.name


def test_the_page_marks_what_is_missed() -> None:
    from track.page import missed, page
    from track.table import BY_NAME

    row = BY_NAME["teddy"]
    results = {
        "teddy": {"contenders": {"nacre": {"ate": 30.0, "lost": 0}, "peer": {"failed": "no such module"}}}
    }
    text = page(results, [])
    assert "**ATE RMSE [mm] 30.0" in text
    assert "no such module" in text
    assert missed(results, [row]) == ["teddy misses ATE RMSE [mm] 30.0 (\N{LESS-THAN OR EQUAL TO} 12)"]


def test_the_section_of_real_recordings_stays_in_the_page() -> None:
    from track.real import TITLE, with_section

    nacre = {"frames": 50, "claimed": 50, "right": 49, "wrong": 1, "far": 0, "ate": 3.0, "milliseconds": 20.0}
    few = {**nacre, "claimed": 5, "right": 5, "ate": 0.1, "milliseconds": 9.0, "busy": True}
    contenders = {"nacre": nacre, "few": few, "slow": {"failed": "not done in 10 minutes"}}
    results = {"real-sr300-shelf": {"contenders": contenders}}
    page = with_section("# Page\n\n## In short\n\nText\n\n## Bunny\n", results, "")
    assert [line for line in page.splitlines() if line.startswith("## ")] == [
        "## In short", f"## {TITLE}", "## Bunny"
    ]  # fmt: skip
    assert "| **49 / 50 / 0** | 5 / 5 / 0 | not done in 10 minutes |" in page
    assert "| **3.0** | 0.1 | - |" in page  # few are no better
    assert "| ~9.0 / - |" in page
    assert with_section("# Page\n\n## In short\n\nText\n\n## Bunny\n", {}, page) == page
    assert with_section(page, results, page) == page


def test_erosion_takes_two_pixels() -> None:
    from track.peers import erode

    depth = np.ones((20, 20), np.float32)
    depth[:, 10:] = 2.0
    kept = np.isfinite(erode(depth))
    np.testing.assert_array_equal(kept[10], np.abs(np.arange(20) - 9.5) > 2)
    depth[:, 10:] = np.nan
    np.testing.assert_array_equal(np.isfinite(erode(depth))[10], np.arange(20) < 8)
