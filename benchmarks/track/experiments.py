"""Rows that are more than one recording: real scans in any order, ways of fusion, unrelated pairs."""

from __future__ import annotations

import itertools
import json
import math
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

from track import commands
from track.figures import TAU, collect
from track.recordings import found, reordered
from track.rows import Figures, Places, Row

SCANS = ("bun000", "bun045", "bun090", "bun180", "bun270", "bun315", "chin", "ear_back", "top2", "top3")
ORDERS = {
    "as named": SCANS,
    "reversed": SCANS[::-1],
    "top scans first": ("top3", "top2", "chin", "ear_back", *SCANS[:6]),
    "shuffled": tuple(SCANS[i] for i in np.random.default_rng(0).permutation(len(SCANS))),
}


def range_scans(places: Places, row: Row) -> dict[str, Figures]:
    """Reconstruct the bunny's ten real scans in several orders; errors are those of the turntable's six."""
    results = {}
    for name, order in ORDERS.items():
        recording = reordered(f"{row.name}-{name.replace(' ', '-')}", found("stanford-bunny/data"), order)(
            places
        )
        out = places.work / "out" / row.name / name.replace(" ", "-")
        out.parent.mkdir(parents=True, exist_ok=True)
        processor = commands.reconstruct(recording, out)
        evaluation = commands.evaluate(out, places.bunny, "--tau", TAU)
        figures = collect(evaluation, out, processor)
        report = json.loads((out / "report.json").read_text())
        figures.update(turntable_errors(report, order))
        results[f"nacre, {name}"] = figures
    return results


def turntable_errors(report: dict[str, Any], order: tuple[str, ...]) -> Figures:
    """
    Compare the poses of the turntable's scans with bun.conf, with the best of them in its place.

    The first scan that comes may be one of the four that bun.conf places less well.
    """
    poses, truths = [], []
    for scan, frame in zip(order, report["frames"], strict=True):
        if not scan.startswith("bun"):
            continue
        if frame["world_from_camera"] is None:
            return {"rotation": None, "translation": None}
        poses.append(np.array(frame["world_from_camera"]))
        truths.append(np.array(frame["truth"]))
    from nacre.evaluation import pose_error

    center = np.array([-0.017, 0.110, -0.001])  # of the bunny
    best: Figures = {"rotation": math.inf, "translation": math.inf}
    for reference in range(len(poses)):
        into = truths[reference] @ np.linalg.inv(poses[reference])
        error = pose_error(np.array([into @ pose for pose in poses]), truths, center=center, align=False)
        if error.translation_max < 1e-3 * best["translation"]:
            best = {
                "rotation": math.degrees(error.rotation_max),
                "translation": 1e3 * error.translation_max,
                "final_rotation": math.degrees(error.rotation_final),
                "final_translation": 1e3 * error.translation_final,
            }
    return best


def fusion_methods(places: Places, row: Row) -> dict[str, Figures]:
    """Fuse the same frames by confidence, WLOP, repaired WLOP, and consolidate all of them at once."""
    assert row.recording is not None
    assert row.mesh is not None
    recording, mesh = row.recording(places), row.mesh(places)
    results: dict[str, Figures] = {}
    folder = places.work / "out" / row.name
    folder.mkdir(parents=True, exist_ok=True)
    for form in ("fuse", "wlop", "wlop+"):
        out = folder / form.replace("+", "-plus")
        settings = ["--set", f"fusion_method={form}"]
        if form != "fuse":  # its own number of points, for an even comparison
            settings += ["--set", f"max_points={results['fuse']['points']:.0f}"]
        processor = commands.reconstruct(recording, out, *settings)
        results[form] = collect(commands.evaluate(out, mesh, "--tau", TAU), out, processor)
    start = time.process_time()
    out = batch(recording, folder / "fuse", folder / "batch", int(results["fuse"]["points"]))
    processor = time.process_time() - start
    figures = collect(commands.evaluate(out, mesh, "--tau", TAU), out, processor)
    results["batch WLOP, poses of fuse"] = figures
    return results


def batch(recording: Path, fused: Path, out: Path, num_points: int) -> Path:
    """Consolidate the cleaned points of all frames, at the poses that were found, with WLOP."""
    import nacre

    report = json.loads((fused / "report.json").read_text())
    sequence = nacre.open_sequence(recording)
    clouds = []
    for frame, known in zip(sequence, report["frames"], strict=True):
        if known["world_from_camera"] is None:
            continue
        pose = np.array(known["world_from_camera"])
        points = nacre.back_project(nacre.preprocess_depth(frame.depth, frame.camera), frame.camera)
        clouds.append(points @ pose[:3, :3].T + pose[:3, 3])
    cloud = np.concatenate(clouds)
    done = nacre.consolidate(cloud, num_points=num_points, radius=4 * report["spacing"], method="wlop+")
    out.mkdir(parents=True, exist_ok=True)
    nacre.write_points(out / "model.ply", done.points)
    (out / "report.json").write_text(json.dumps(report))
    return out


def long_recording(places: Places, row: Row) -> dict[str, Figures]:
    """Turn the bunny before a Kinect for 2000 frames: time, memory and size once its surface is covered."""
    import nacre

    mesh = nacre.read_mesh(places.bunny)
    camera = nacre.Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    per_turn, num_frames, covered = 120, 2000, 400
    poses = nacre.turntable_poses(mesh, per_turn, 2 * math.pi / per_turn, camera=camera, distance=0.4)
    model = nacre.Model(camera)
    tracked, seconds, points, resident = 0, [], [], []
    for i in range(num_frames):
        depth = mesh.simulate_depth(camera, poses[i % per_turn], noise="kinect", edge_mixing=1.0, seed=i)
        start = time.process_time()
        tracked += model.add_frame(depth).status == "TRACKED"
        seconds.append(time.process_time() - start)
        points.append(len(model.points))
        resident.append(resident_memory())
    turns = [np.mean(seconds[i : i + per_turn]) for i in range(0, num_frames - per_turn + 1, per_turn)]
    early, late = np.median(turns[2:7]), np.median(turns[-5:])
    return {
        "nacre": {
            "frames": num_frames,
            "tracked": tracked,
            "points": points[-1],
            "more_points": 100 * (points[-1] / points[covered] - 1),
            "more_time": 100 * (late / early - 1),
            "more_memory": resident[-1] - resident[covered],
            "processor": sum(seconds),
        }
    }


def resident_memory() -> float:
    """Return what this process holds in memory [MB]; NaN where the system does not tell."""
    file = Path("/proc/self/statm")
    pages = int(file.read_text().split()[1]) if file.exists() else math.nan
    return pages * resource.getpagesize() / 1e6


def unrelated_pairs(places: Places, row: Row) -> dict[str, Figures]:
    """Give a model of one scene an image of another: it must be lost. Counts what is taken for tracked."""
    import nacre

    camera = nacre.Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    meshes = [nacre.built_in_object(), nacre.read_mesh(places.bunny)]
    for name, scale in (("homer.obj", 0.2), ("spot.obj", 0.1), ("libigl_fandisk.off", 0.03)):
        mesh = nacre.read_mesh(places.data / "meshes" / name)
        meshes.append(nacre.Mesh(scale * mesh.vertices, mesh.triangles))
    views: list[tuple[int, Any]] = []
    for scene, mesh in enumerate(meshes):
        poses = nacre.turntable_poses(mesh, 6, math.radians(60), camera=camera, distance=0.4)
        views += [
            (scene, mesh.simulate_depth(camera, pose, noise=0.001, edge_mixing=1.0, seed=i))
            for i, pose in enumerate(poses)
        ]
    for scene, name in enumerate(("tum-fr3-teddy", "tum-fr1-rpy"), start=len(meshes)):
        if (places.data / name).exists():
            sequence = nacre.open_sequence(places.data / name)
            views += [
                (scene, sequence[i].depth[::2, ::2]) for i in range(0, len(sequence), len(sequence) // 6)
            ]
    pairs = [(a, b) for a, b in itertools.permutations(range(len(views)), 2) if views[a][0] != views[b][0]]
    chosen = np.random.default_rng(0).permutation(len(pairs))[:1000]
    start, accepted, weak = time.process_time(), 0, 0
    for i in chosen:
        a, b = pairs[i]
        model = nacre.Model(camera)
        model.add_frame(views[a][1])
        status = model.add_frame(views[b][1]).status
        accepted += status in ("TRACKED", "RELOCALISED")
        weak += status == "WEAK"
    spent = time.process_time() - start
    return {
        "nacre": {
            "frames": len(chosen),
            "tracked": accepted,
            "weak": weak,
            "lost": len(chosen) - accepted - weak,
            "processor": spent,
        }
    }
