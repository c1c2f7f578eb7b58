"""The benchmark suite: its registry, its turns, its report."""

import json
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(autouse=True, scope="module")
def _importable() -> Iterator[None]:
    sys.path.insert(0, str(BENCHMARKS))
    yield
    sys.path.remove(str(BENCHMARKS))


def results_of(
    *contenders: tuple[str, list[float], dict[str, float]], threads: int = 2
) -> list[dict[str, Any]]:
    return [
        {
            "workload": "work",
            "contender": name,
            "peer": name.partition(",")[0],
            "threads": threads,
            "seconds": seconds,
            "stages": {"build": seconds, "query": seconds},
            "errors": errors,
            "memory": 4000,
            "failed": None if seconds else "ValueError: no | such thing",
        }
        for name, seconds, errors in contenders
    ]


def canned(*contenders: tuple[str, list[float], dict[str, float]]) -> dict[str, Any]:
    return {
        "date": "today",
        "quick": True,
        "threads": [2],
        "machine": {"processor": "one"},
        "versions": {"nacre": "1"},
        "limits": {"bandwidth": {"2": 1e9}, "operations": {"2": 1e9}, "latency": {"1 MiB": 8e-9}},
        "packages": {"nacre": {"installed": 2_000_000, "import": 0.1, "wheel": 500_000}},
        "workloads": {
            "work": {
                "title": "Work",
                "items": 1000,
                "limits": {"error": 0.5},
                "goal": 4,
                "milliseconds": None,
                "steps": 1,
                "note": "",
                "bound": {"formula": "counted", "bytes": 1e6, "operations": 5e6},
            }
        },
        "results": results_of(*contenders),
    }


RUN = canned(
    ("nacre", [0.010, 0.030, 0.020], {"error": 0.1}),
    ("fast, but wrong", [0.001, 0.001, 0.001], {"error": 0.6}),
    ("slow", [0.050, 0.060, 0.070], {"error": 0.2}),
    ("unknown", [0.005, 0.005, 0.005], {"error": float("nan")}),
    ("broken", [], {}),
)


def test_the_ratio_is_of_medians_and_against_the_fastest_right_answer() -> None:
    import report

    ours, best = report.leaders(RUN, "work", 2)
    assert ours is not None
    assert best is not None
    assert best["contender"] == "slow"
    assert report.ratio(best, ours) == pytest.approx(3.0)


def test_the_report_names_goals_failures_and_bounds() -> None:
    import report

    page = report.markdown(json.loads(json.dumps(RUN)))
    assert "| 20 | slow: 60 | **3.0** (goal 4) |" in page
    assert "20 [10-30] n=3" in page
    assert "(0.05)" in page  # not compared with
    assert "- broken: ValueError: no | such thing" in page
    assert "| work | 2 | 1 | 5 | 20 | 4.0 |" in page
    tables = [line for line in page.splitlines() if line.startswith("|")]
    assert all(line.endswith("|") for line in tables)


def test_a_run_without_peers_or_limits_still_makes_a_page() -> None:
    import report

    run = canned(("nacre", [], {}))
    run["limits"] = {}
    page = report.markdown(run)
    assert "Not measured" in page
    assert "bounds" not in page


def test_the_registry_is_well_formed() -> None:
    from suite.registry import all_workloads

    workloads = all_workloads()
    assert {"knn-1000k-random", "normals-100k", "icp-100k", "wlop-cgal-100k-50", "depth-all"} <= set(
        workloads
    )
    for name, workload in workloads.items():
        names = [contender.name for contender in workload.contenders]
        assert name == workload.name
        assert name == name.lower().replace(" ", "-")
        assert len(names) == len(set(names))
        assert "nacre" in {contender.peer for contender in workload.contenders}
        assert workload.contender(names[-1]).name == names[-1]
        assert workload.items > 0
        assert workload.steps > 0


def test_turns_rotate_and_failures_stay() -> None:
    from suite import contest
    from suite.workload import Contender, Workload

    contenders = [Contender(name, lambda arrays, threads: lambda lap: {}) for name in ("a", "b", "c")]
    work = Workload("work", "Work", 1, dict, contenders, lambda arrays, answer: {}, {})
    order: list[str] = []

    def turn(contender: Contender, first: bool) -> dict[str, Any]:
        order.append(contender.name)
        if contender.name == "b" and not first:
            return {"failed": "tired"}
        seconds = 30.0 if contender.name == "c" else 0.001
        return {"seconds": seconds, "stages": {"all": seconds}, "errors": {}, "memory": 0}

    a, b, c = contest.contend(work, 2, 3, turn)
    assert order == ["a", "b", "c", "a", "b", "c", "a", "a"]
    assert len(a["seconds"]) == 3
    assert b["failed"] == "tired"
    assert c["seconds"] == [30.0, 30.0]  # so slow: its first run counts, and one more
    assert c["stages"] == {"all": [30.0, 30.0]}


@pytest.mark.parametrize("first", [True, False])
def test_nacre_in_a_turn_gives_right_answers(first: bool) -> None:
    from suite import worker
    from suite.workloads import neighbors, normals

    found = neighbors.self_query(1000, ordered=True)
    arrays = found.data()
    said = worker.turn(found, found.contender("nacre"), arrays, 2, first)
    assert set(said["stages"]) == {"build", "query"}
    assert said["seconds"] == pytest.approx(sum(said["stages"].values()))
    if first:
        assert said["errors"]["distance error"] < 1e-6
        assert said["errors"]["index error"] < 1e-12
        answer = found.contender("nacre").make(arrays, 1)(lambda stage, seconds=None: None)
        wrong = {**answer, "indices": np.roll(answer["indices"], 1, axis=0)}
        assert found.check(arrays, wrong)["index error"] > found.limits["index error"]

    work = normals.workload(2000)
    said = worker.turn(work, work.contender("nacre"), work.data(), 2, first)
    if first:
        assert said["errors"]["missing [%]"] == 0
        assert said["errors"]["median angle [deg]"] < 8


def test_consolidation_and_poses_are_checked_against_the_truth() -> None:
    from suite.workloads import consolidation, registration

    arrays = consolidation.data(1000)
    work = consolidation.workload(1000, 50, goal=1)
    answer = work.contender("nacre").make(arrays, 1)(lambda stage, seconds=None: None)
    assert work.check(arrays, answer) == {"points": 500.0}
    same = {"points": answer["points"], "starts": answer["points"]}
    assert partial(consolidation.check, size=500)(arrays, same)["nacre apart, median [spacings]"] > 0

    truth = np.tile(np.eye(4), (4, 1, 1))
    errors = registration.check({"truth": truth}, {"poses": truth})
    assert errors == {"rotation [deg]": 0.0, "translation [mm]": 0.0}


def test_the_worker_answers_and_survives_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from suite.contest import Workers
    from suite.workloads import neighbors

    monkeypatch.syspath_prepend(str(BENCHMARKS))
    monkeypatch.setenv("PYTHONPATH", str(BENCHMARKS), prepend=":")
    work = neighbors.self_query(10_000, ordered=False)
    for name, array in work.data().items():
        np.save(tmp_path / f"{name}.npy", array)
    with Workers(1) as workers:
        said = workers.turn(work.name, str(tmp_path), work.contender("nacre"), True)
        assert said["errors"]["index error"] < 1e-12, said
        command = {"workload": work.name, "data": str(tmp_path), "contender": "nobody", "first": True}
        assert "StopIteration" in workers.ask("nacre", command)["failed"]
        assert "numpy" in workers.ask("nacre", {"versions_of": ["numpy", "nobody"]})
