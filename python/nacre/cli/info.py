"""``nacre info``: what is in a recording, a point file or a mesh."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from nacre._internal.camera_names import is_camera
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption, open_source
from nacre.cli.surfaces import has_faces, mesh_suffixes, point_suffixes
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose

Rows = list[tuple[str, str]]


def info(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE", help="A recording, a point file, a mesh, or realsense.", show_default=False
        ),
    ],
    format: FormatOption = None,
    camera: CameraOption = None,
    depth_scale: DepthScaleOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Tell what is in a recording, a point file, a mesh or a run, or what a camera is (realsense, ...)."""
    terminal = Terminal(json, quiet, verbose)
    if is_camera(source):
        terminal.answer(*_camera(source))
        return
    if not source.exists():
        raise CommandError(f"no such file or folder: {source}", 2)
    if (source / "unfinished" / "run.json").is_file():
        terminal.answer(*describe_unfinished(source))
        return
    if (source / "report.json").is_file():
        terminal.answer(*_finished(source))
        return
    from nacre.datasets.detect import FILE_SUFFIXES

    if source.is_dir() or source.suffix.lower() in FILE_SUFFIXES or format is not None:
        figures, rows = _recording(open_source(source, format, camera, depth_scale))
    elif source.suffix.lower() in point_suffixes() and not (
        source.suffix.lower() == ".ply" and has_faces(source)
    ):
        from nacre.datasets.stanford import recognise

        figures, rows = _points(source)
        if recognise(source):
            rows.append(("range scan", "yes: nacre reconstruct takes it, and folders of such scans"))
            figures["range_scan"] = True
    elif source.suffix.lower() in mesh_suffixes():
        figures, rows = _mesh(source)
    else:
        known = ", ".join(dict.fromkeys(point_suffixes() + mesh_suffixes()))
        recordings = ", ".join(FILE_SUFFIXES)
        raise CommandError(
            f"{source}: neither a recording (a folder, {recordings}) nor points or triangles ({known})", 2
        )
    terminal.answer(figures, rows)


def _camera(source: Path) -> tuple[dict[str, Any], Rows]:
    from nacre.datasets.live_cameras import open_camera

    camera = open_camera(source)
    try:
        frame = next(iter(camera))
    finally:
        camera.close()
    figures = {
        "kind": "camera", "name": camera.name, "serial": camera.serial, "depth_scale": camera.depth_scale,
        "color": frame.color is not None, "confidence": frame.confidence is not None,
    }  # fmt: skip
    from nacre.reconstruction.description import describe_camera

    return figures, [
        ("camera", camera.name + f", serial number {camera.serial}" * bool(camera.serial)),
        ("depth", describe_camera(camera.camera)),
        ("depth scale", f"{camera.depth_scale:g} stored units per metre"),
        ("colour", "yes" if frame.color is not None else "no"),
        ("confidence", "yes" if frame.confidence is not None else "no"),
    ]


def _recording(sequence: Any) -> tuple[dict[str, Any], Rows]:
    import numpy as np

    from nacre.errors import FileFormatError
    from nacre.reconstruction.description import describe_camera, describe_recording

    figures = {"kind": "recording", **describe_recording(sequence), "timestamps": sequence.has_timestamps}
    rows = [
        ("recording", sequence.name),
        ("format", sequence.format),
        ("frames", str(len(sequence))),
        ("camera", describe_camera(sequence.camera)),
        ("depth scale", f"{sequence.depth_scale:g} stored units per metre"),
    ]
    figures["first_frame"] = None
    for i in range(min(len(sequence), 10)):
        try:
            depth = sequence[i].depth
        except FileFormatError as error:
            rows.append((f"frame {i}", f"cannot be read: {error}"))
            continue
        valid = depth[np.isfinite(depth)]
        if len(valid):
            low, middle, high = (float(value) for value in np.percentile(valid, (0, 50, 100)))
            part = len(valid) / depth.size
            figures["first_frame"] = {"index": i, "min": low, "median": middle, "max": high, "measured": part}
            text = f"{low:.3f} to {high:.3f} m, median {middle:.3f} m; {100 * part:.1f} % of the pixels"
            rows.append((f"depth of frame {i}", text))
            break
    rows += [
        ("colour", "yes" if sequence.has_color else "no"),
        ("time stamps", "yes" if sequence.has_timestamps else "no"),
        ("true poses", f"yes, {len(sequence.truth)}" if sequence.truth is not None else "no"),
    ]
    return figures, rows


def _points(path: Path) -> tuple[dict[str, Any], Rows]:
    import nacre
    from nacre.run_data.text import count

    cloud = nacre.read_points(path)
    figures, rows = _geometry(cloud.points)
    fields = [name for name in ("normals", "colors") if getattr(cloud, name) is not None]
    attributes = {name: array.dtype.name for name, array in cloud.attributes.items()}
    words = [*fields, *(f"{name} ({dtype})" for name, dtype in attributes.items())]
    figures = {
        "kind": "points", "path": str(path), "num_points": len(cloud), "dtype": cloud.points.dtype.name,
        "fields": fields, "attributes": attributes, "shape": cloud.shape,
        "comments": cloud.comments, **figures,
    }  # fmt: skip
    organised = (
        [] if cloud.shape is None else [("organised", f"{cloud.shape[0]} rows x {cloud.shape[1]} columns")]
    )
    head = [
        ("points", f"{count(len(cloud))} ({cloud.points.dtype.name})"),
        ("fields", ", ".join(words) or "coordinates only"),
    ]
    return figures, [*head, *organised, *rows, *(("comment", text) for text in cloud.comments[:5])]


def _mesh(path: Path) -> tuple[dict[str, Any], Rows]:
    import nacre
    from nacre.run_data.text import count

    mesh = nacre.read_mesh(path)
    figures, rows = _geometry(mesh.vertices)
    figures = {
        "kind": "mesh", "path": str(path), "num_vertices": len(mesh.vertices),
        "num_triangles": len(mesh.triangles), **figures,
    }  # fmt: skip
    head = [("mesh", f"{count(len(mesh.vertices))} vertices, {count(len(mesh.triangles))} triangles")]
    return figures, head + rows


def _geometry(points: Any) -> tuple[dict[str, Any], Rows]:
    import numpy as np

    from nacre.evaluation import uniformity
    from nacre.run_data.text import count

    finite = points[np.isfinite(points).all(axis=1)]
    figures: dict[str, Any] = {"num_finite": len(finite), "lower": None, "upper": None, "spacing": None}
    if not len(finite):
        return figures, [("finite", "no point is finite")]
    lower, upper = finite.min(axis=0), finite.max(axis=0)
    spacing = uniformity(finite)
    figures |= {"lower": lower, "upper": upper, "spacing": spacing.as_dict()}
    rows = [
        ("size", " x ".join(f"{side:.4g}" for side in upper - lower)),
        ("bounds", f"({', '.join(f'{x:.4g}' for x in lower)}) to ({', '.join(f'{x:.4g}' for x in upper)})"),
    ]
    if len(finite) > 1:
        variation = spacing.coefficient_of_variation
        told = f"{spacing.mean:.4g} mean" if math.isfinite(spacing.mean) else "too wide to be measured"
        rows.append(("spacing", told + f", variation {variation:.3f}" * math.isfinite(variation)))
    if len(finite) < len(points):
        rows.append(("not finite", f"{count(len(points) - len(finite))} points"))
    return figures, rows


def _finished(out: Path) -> tuple[dict[str, Any], Rows]:
    """Return what there is to tell of a finished run."""
    from nacre.cli.outputs import file_rows, verdict_rows
    from nacre.run_data.saved_run import SavedRun
    from nacre.run_data.text import count

    report = {"verdict": None, "point_sigma": None, **SavedRun(out).report}
    counts = {name: report.get(name) for name in ("num_frames", "num_tracked", "num_points")}
    source = (report.get("recording") or {}).get("path", "a recording")
    return {"kind": "run", "path": str(out), "verdict": report["verdict"], **counts}, [
        ("run", f"nacre reconstruct of {source}"),
        ("frames tracked", f"{counts['num_tracked']} of {counts['num_frames']}"),
        ("model", f"{count(counts['num_points'] or 0)} points"),
        *verdict_rows(report),
        *file_rows(out, page=(out / "report.html").is_file()),
        ("look at it", f"nacre view {out}"),
    ]


def describe_unfinished(out: Path) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Return what there is to tell of an unfinished run."""
    from nacre.reconstruction.journal import read_journal
    from nacre.reconstruction.resume import UnfinishedRun, read_document
    from nacre.reconstruction.run_options import options_before

    unfinished = UnfinishedRun(out)
    source = options_before(read_document(unfinished), unfinished.document_path)[0].source
    entries, _ = read_journal(unfinished.journal_path)
    figures = {"kind": "unfinished run", "path": str(out), "source": source, "num_done": len(entries)}
    lost = sum(entry[2] == "LOST" for entry in entries)
    return figures, [
        ("unfinished run", f"of {source}"),
        ("frames done", f"{len(entries)}" + f", {lost} lost" * bool(lost)),
        ("go on", f"nacre reconstruct --resume {out}"),
    ]
