"""What run.py starts in the environment: ``python -m suite OPTIONS``, the options as JSON."""

from __future__ import annotations

import datetime
import json
import sys
import time
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import report

from suite import contest, machine
from suite.registry import all_workloads
from suite.workload import Workload


def describe(workload: Workload) -> dict[str, Any]:
    """Return what the report says of a workload."""
    bound = workload.bound
    return {
        "title": workload.title,
        "items": workload.items,
        "limits": dict(workload.limits),
        "goal": workload.goal,
        "milliseconds": workload.milliseconds,
        "steps": workload.steps,
        "note": workload.note,
        "bound": bound and {"formula": bound.formula, "bytes": bound.bytes, "operations": bound.operations},
    }


def tell(text: str) -> None:
    """Say how far it is."""
    print(text, file=sys.stderr, flush=True)


def keep_others(results: dict[str, Any], file: Path, chosen: set[str]) -> None:
    """Take over what an earlier run on the same machine, of the same versions, has of other workloads."""
    results["minutes"] = 0.0
    before = json.loads(file.read_text()) if file.exists() else {}
    if any(before.get(key) != results[key] for key in ("quick", "threads", "versions")):
        return
    if before["machine"].get("processor") != results["machine"]["processor"]:
        return
    results["minutes"] = before["minutes"]
    kept = {name: told for name, told in before["workloads"].items() if name not in chosen}
    results["workloads"] = kept
    results["results"] = [measured for measured in before["results"] if measured["workload"] in kept]


def main() -> int:
    """Choose, measure, write."""
    options = json.loads(sys.argv[1])
    workloads = list(all_workloads().values())
    if options["list"]:
        for workload in workloads:
            print(f"{workload.name:24} {workload.title}{'' if workload.quick else ' (not in --quick)'}")
        return 0
    patterns = options["only"]
    unknown = [p for p in patterns if not any(fnmatch(workload.name, p) for workload in workloads)]
    if unknown:
        tell(f"no workload is called {', '.join(unknown)}; see --list")
        return 2
    chosen = [w for w in workloads if any(fnmatch(w.name, p) for p in patterns)] if patterns else workloads
    if options["quick"]:
        chosen = [workload for workload in chosen if workload.quick]
    start, others = time.perf_counter(), machine.Others()
    results: dict[str, Any] = {
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "quick": options["quick"],
        "threads": options["threads"],
        "machine": machine.describe(),
        "versions": machine.versions(),
        "limits": machine.limits(options["threads"]),
        "packages": machine.packages(options["wheel"]),
        "workloads": {},
        "results": [],
    }
    folder = Path(options["output"])
    folder.mkdir(parents=True, exist_ok=True)
    keep_others(results, folder / "results.json", {workload.name for workload in chosen})
    minutes_before = results["minutes"]

    def write() -> None:
        results["minutes"] = minutes_before + (time.perf_counter() - start) / 60
        (folder / "results.json").write_text(json.dumps(results, indent=1) + "\n")
        (folder / "results.md").write_text(report.markdown(results))

    # What has been measured is kept if the run is ended early.
    for workload, measured in contest.run(chosen, options["threads"], options["repeats"], tell):
        told = {**results["workloads"], workload.name: describe(workload)}
        results["workloads"] = {each.name: told[each.name] for each in workloads if each.name in told}
        results["results"] += measured
        write()
    # What the workers took is known when they have ended.
    results["machine"]["taken by other processes"] = f"{100 * others.share():.0f} % of the processors' time"
    write()
    tell(f"{results['minutes']:.1f} minutes; see {folder / 'results.md'}")
    if others.share() > 0.05:
        tell("other processes kept the machine busy: the times say little")
    return 0


if __name__ == "__main__":
    sys.exit(main())
