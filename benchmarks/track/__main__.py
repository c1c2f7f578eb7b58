"""Runs the rows, prints the table, and keeps every figure in ``results.json``."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

from track import commands, page, pictures, real
from track.figures import TAU, collect
from track.peers import TITLES
from track.right import right_frames
from track.rows import Figures, Places, Row
from track.table import BY_NAME, ROWS


def run_row(places: Places, row: Row, peers: list[str] | None) -> dict[str, Figures]:
    """Return the figures of every contender, or of some peers, or of nacre alone, or why it has none."""
    if row.measure is not None:
        return row.measure(places, row)
    assert row.recording is not None
    recording = row.recording(places)
    results: dict[str, Figures] = {}
    for name, settings in row.settings.items() if not peers else ():
        results[name] = attempt(
            places, row, name, lambda out, options=settings: commands.reconstruct(recording, out, *options)
        )
    for peer in [peer for peer in row.peers if peers is None or peer in peers]:
        results[TITLES[peer]] = attempt(
            places, row, peer, lambda out, name=peer: commands.run_peer(name, recording, out, row.voxel)
        )
    return results


def attempt(places: Places, row: Row, name: str, run: Any) -> Figures:
    """Run a contender and evaluate what it wrote."""
    out = places.work / "out" / row.name / name.replace(" ", "-").replace("+", "-plus")
    out.parent.mkdir(parents=True, exist_ok=True)
    print(f"{row.name}: {name}", file=sys.stderr, flush=True)
    try:
        processor = run(out)
        arguments: list[Any] = []
        report = json.loads((out / "report.json").read_text())
        if row.mesh is not None and report.get("has_model", True):
            arguments = [row.mesh(places), "--tau", TAU, "--scale", row.scale]
        known = any(frame["truth"] is not None for frame in report["frames"])
        evaluation = commands.evaluate(out, *arguments) if known or arguments else {}
        figures = collect(evaluation, out, processor)
        if row.real and row.recording is not None:
            figures |= right_frames(row.recording(places), out)
        return figures
    except (RuntimeError, OSError, ValueError) as error:
        return {"failed": str(error)}


def write_page(
    target: Path, places: Places, output: Path, results: dict[str, Any], *, only_real: bool
) -> None:
    """Write the page and its pictures; of a page that is there, perhaps only the real recordings' section."""
    old = whole = target.read_text() if target.exists() else ""
    if not (only_real and old):
        drawn = pictures.write_all(places, output / "pictures")
        shown = [name for name in drawn if name in page.PICTURES]
        (target.parent / "images").mkdir(exist_ok=True)
        for name in shown:
            shutil.copy(output / "pictures" / name, target.parent / "images" / name)
        whole = page.page(results, shown)
    target.write_text(real.with_section(whole, results, old))


def main() -> int:
    """Run what was asked for; results of other rows in ``results.json`` stay."""
    options = json.loads(sys.argv[1])
    places = Places(Path(options["data"]), Path(options["work"]))
    output = Path(options["output"])
    output.mkdir(parents=True, exist_ok=True)
    file = output / "results.json"
    results: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    unknown = [name for name in options["only"] if name not in BY_NAME]
    if unknown:
        print(f"there is no row {', '.join(unknown)}; there are {', '.join(BY_NAME)}", file=sys.stderr)
        return 2
    for row in ROWS:
        if row.name not in options["only"] if options["only"] else row.real != options["real"]:
            continue
        if options["peers"] and not set(options["peers"]) & set(row.peers):
            continue
        try:
            found = run_row(places, row, options["peers"])
        except (FileNotFoundError, RuntimeError) as error:
            print(f"{row.name} is left out: {error}", file=sys.stderr)
            continue
        for figures in found.values():
            figures["busy"] = options["busy"]
        kept = {} if options["peers"] is None else results.get(row.name, {}).get("contenders", {})
        results[row.name] = {"date": commands.stamp(), "contenders": {**kept, **found}}
        file.write_text(json.dumps(results, indent=1) + "\n")
        print(page.section(row, results[row.name]))
    if options["page"]:
        write_page(Path(options["page"]), places, output, results, only_real=options["real"])
    missed = page.missed(results, [row for row in ROWS if not options["only"] or row.name in options["only"]])
    print("\n".join(missed) if missed else "every goal of these rows is reached")
    return 0


if __name__ == "__main__":
    sys.exit(main())
