#!/usr/bin/env python3
"""Write the results of a run as Markdown: ``report.py results.json docs/benchmarks.md``."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from statistics import median
from typing import Any

from headings import link_to

Result = dict[str, Any]


def markdown(run: dict[str, Any]) -> str:
    """Return the page of a run."""
    parts = [introduction(run), summary(run), growth(run), bounds(run), packages(run)]
    parts += ["## Every workload\n"] + [workload(run, name) for name in run["workloads"]]
    return "\n".join(part for part in parts if part)


def introduction(run: dict[str, Any]) -> str:
    """Say what was run, on what, and how to read it."""
    rows = [[key, value] for key, value in run["machine"].items()]
    rows += [["versions", ", ".join(f"{name} {version}" for name, version in run["versions"].items())]]
    command = "python benchmarks/run.py" + (" --quick" if run["quick"] else "")
    minutes = f", {run['minutes']:.0f} minutes" if "minutes" in run else ""
    return f"""# Benchmarks

Made by `{command}` on {run["date"]}{minutes}; `benchmarks/README.md` says how it is measured.

Times are medians over turns in which all contenders ran one after the other, in milliseconds, with the
smallest and the largest turn in brackets. "Times faster" is the median of the fastest peer whose answer is
good enough, divided by nacre's.

{table(["", ""], rows)}"""


def summary(run: dict[str, Any]) -> str:
    """Return one line a workload: nacre against the fastest peer."""
    heads = ["work"]
    for threads in run["threads"]:
        heads += [f"nacre, {plural(threads)} [ms]", "fastest peer [ms]", "times faster"]
    rows = []
    for name, about in run["workloads"].items():
        row = [link_to(about["title"])]
        for threads in run["threads"]:
            if not results(run, name, threads):
                row += ["not run", "-", "-"]
                continue
            ours, best = leaders(run, name, threads)
            row += [
                time_of(median(ours["seconds"]), about) if ours else "not good enough, see below",
                f"{best['contender']}: {time_of(median(best['seconds']), about)}" if best else "-",
                f"**{times(ratio(best, ours))}**" if ours and best else "-",
            ]
        if about["goal"]:
            row[-1] += f" (goal {about['goal']:.3g})"
        if about["milliseconds"]:
            row[-3] += f" (goal {about['milliseconds']:.3g})"
        rows.append(row)
    return f"## Summary\n\n{table(heads, rows)}"


def leaders(run: dict[str, Any], name: str, threads: int) -> tuple[Result | None, Result | None]:
    """Return nacre's fastest contender and the peers', of those whose answers are good enough."""
    rows = [row for row in results(run, name, threads) if accepted(row, run["workloads"][name])]
    ours = [row for row in rows if row["peer"] == "nacre"]
    peers = [row for row in rows if row["peer"] != "nacre"]
    fastest = (min(group, key=lambda row: median(row["seconds"]), default=None) for group in (ours, peers))
    first, second = fastest
    return first, second


def results(run: dict[str, Any], name: str, threads: int | None = None) -> list[Result]:
    """Return the results of a workload."""
    return [r for r in run["results"] if r["workload"] == name and threads in (None, r["threads"])]


def accepted(result: Result, about: dict[str, Any]) -> bool:
    """Whether it ran, and no error exceeds its limit (an error that is not a number does)."""
    if result["failed"] or not result["seconds"]:
        return False
    found = result["errors"]
    return all(found[key] <= limit for key, limit in about["limits"].items() if key in found)


def ratio(peer: Result, ours: Result) -> float:
    """Return how many times faster nacre is."""
    return float(median(peer["seconds"]) / median(ours["seconds"]))


def workload(run: dict[str, Any], name: str) -> str:
    """Return the table of one workload."""
    about = run["workloads"][name]
    rows = results(run, name)
    errors = list(dict.fromkeys(key for row in rows for key in row["errors"]))
    stages = any(len(row["stages"]) > 1 for row in rows)
    counts = [threads for threads in run["threads"] if results(run, name, threads)]
    heads = ["contender", *(f"{plural(threads)} [ms]" for threads in counts), "times nacre's"]
    heads += ["stages [ms]"] * stages + errors + ["memory [B per item]"]
    lines, failures = [], []
    for contender in dict.fromkeys(row["contender"] for row in rows):
        own = {row["threads"]: row for row in rows if row["contender"] == contender}
        last = own[counts[-1]]
        failed = next((row["failed"] for row in own.values() if row["failed"]), None)
        if failed:
            failures.append(f"- {contender}: {failed}")
            continue
        ours, _ = leaders(run, name, counts[-1])
        slower = times(ratio(last, ours)) if ours else "-"
        line = [contender, *(spread(own[threads]["seconds"], about) for threads in counts)]
        line += [slower if accepted(last, about) else f"({slower})"]
        if stages:
            spent = {key: median(value) for key, value in last["stages"].items()}
            line += [", ".join(f"{key} {time_of(value, about)}" for key, value in spent.items())]
        line += [figure(last["errors"].get(key)) for key in errors]
        line += [f"{last['memory'] / about['items']:,.0f}" if last["memory"] is not None else "-"]
        lines.append(line)
    title = f"### {about['title']}\n\n`{name}`. {about['note']}".rstrip()
    text = f"{title}\n\n{table(heads, lines)}"
    if about["limits"]:
        allowed = " and ".join(f"{key} up to {limit:g}" for key, limit in about["limits"].items())
        text += f"\nGood enough: {allowed}; a contender in brackets is not, and is not compared with.\n"
    return text + ("\nNot measured:\n\n" + "\n".join(failures) + "\n" if failures else "")


def growth(run: dict[str, Any]) -> str:
    """Return nacre's time per item of the workloads that come in several sizes, and per pixel of the loop."""
    families: dict[str, dict[int, str]] = {}
    pixels: list[list[str]] = []
    for name, about in run["workloads"].items():
        ours, _ = leaders(run, name, run["threads"][-1])
        if not ours:
            continue
        each = median(ours["seconds"]) / about["items"] * 1e9
        size = f"{about['items'] // 1000}k"
        if size in name and about["items"] >= 10_000:
            families.setdefault(name.replace(f"-{size}", ""), {})[about["items"]] = f"{each:,.0f}"
        if image := re.search(r"-(\d+)x(\d+)$", name):
            milliseconds = time_of(median(ours["seconds"]), about)
            pixels.append([" x ".join(image.groups()), milliseconds, f"{each / about['steps']:.0f}"])
    families = {name: times for name, times in families.items() if len(times) > 1}
    sizes = sorted({size for times in families.values() for size in times})
    rows = [[name, *(times.get(size, "-") for size in sizes)] for name, times in families.items()]
    parts = []
    if rows:
        parts.append(table(["nanoseconds a point", *(f"{size:,}" for size in sizes)], rows))
    if pixels:
        heads = ["the loop in a room, pixels", "a frame [ms]", "nanoseconds a pixel"]
        parts.append(table(heads, pixels))
    if not parts:
        return ""
    text = (
        f"{plural(run['threads'][-1])}. With points that are out of view a frame's time hardly grows: "
        "[a model of five million](scaling.md#long-recordings)."
    )
    return "\n".join([f"## How nacre's cost grows\n\n{text}\n", *parts])


def bounds(run: dict[str, Any]) -> str:
    """Return how far each kernel is from what the machine gives."""
    limits = run["limits"]
    if not limits:
        return ""
    rows = []
    formulas: dict[str, list[str]] = {}
    for name, about in run["workloads"].items():
        for threads in run["threads"]:
            ours, _ = leaders(run, name, threads)
            if not about["bound"] or not ours:
                continue
            memory = about["bound"]["bytes"] / limits["bandwidth"][str(threads)]
            work = about["bound"]["operations"] / limits["operations"][str(threads)]
            measured = median(ours["seconds"])
            row = [name, str(threads), time_of(memory, {}), time_of(work, {}), time_of(measured, {})]
            rows.append([*row, f"{measured / max(memory, work):.1f}"])
            names = formulas.setdefault(about["bound"]["formula"], [])
            names += [name] * (name not in names)
    machine = ", ".join(
        f"{plural(threads)}: {limits['bandwidth'][str(threads)] / 1e9:.0f} GB/s (triad), "
        f"{limits['operations'][str(threads)] / 1e9:.0f} GFLOP/s (float multiply-add)"
        for threads in run["threads"]
    )
    latency = ", ".join(f"{seconds * 1e9:.0f} ns in {size}" for size, seconds in limits["latency"].items())
    heads = ["kernel", "threads", "memory [ms]", "operations [ms]", "nacre [ms]", "times its bound"]
    return f"""## Distance from the machine's bounds

Measured in the same run: {machine}; a load that depends on the one before takes {latency}.

A kernel's bound is what it must move over the bandwidth, or what it must compute over the peak, whichever is
longer. Searching, sorting and waiting for loads are not counted, so no kernel can reach 1.

{table(heads, rows)}
Counted, for each point or pixel:

{chr(10).join(f"- {text}: {', '.join(names)}" for text, names in formulas.items())}
"""


def packages(run: dict[str, Any]) -> str:
    """Return sizes and times of import."""
    rows = []
    for name, found in run["packages"].items():
        wheel = f"{found['wheel'] / 1e6:.1f}" if "wheel" in found else "-"
        rows.append([name, wheel, f"{found['installed'] / 1e6:.1f}", f"{found['import'] * 1e3:.0f}"])
    heads = ["package", "wheel [MB]", "installed [MB]", "import [ms]"]
    text = "Installed without what they depend on; imported in a new process, NumPy included."
    return f"## Packages\n\n{text}\n\n{table(heads, rows)}"


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def plural(threads: int) -> str:
    """Return the number of threads in words."""
    return f"{threads} thread{'s' if threads > 1 else ''}"


def time_of(seconds: float, about: dict[str, Any]) -> str:
    """Return milliseconds with three digits, of one of the runs in a turn."""
    value = seconds * 1e3 / about.get("steps", 1)
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def spread(seconds: list[float], about: dict[str, Any]) -> str:
    """Return median, smallest and largest, and how many where they are few."""
    middle, least, most = (time_of(f(seconds), about) for f in (median, min, max))
    text = f"{middle} [{least}-{most}]"
    return text if len(seconds) >= 5 else f"{text} n={len(seconds)}"


def times(value: float) -> str:
    """Return a ratio with two digits or one behind the point."""
    return f"{value:.1f}" if value >= 1 else f"{value:.2g}"


def figure(value: float | None) -> str:
    """Return an error with three digits, a count with all."""
    return "-" if value is None else f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    target.write_text(markdown(json.loads(source.read_text())))
