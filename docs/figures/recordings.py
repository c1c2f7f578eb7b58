#!/usr/bin/env python
"""
Draw the pictures of real recordings, which ask for the recordings, Open3D and Chromium.

``python docs/figures/recordings.py --data FOLDER`` draws all into ``docs/images``; names draw some:
``meshes`` (nacre's beside Open3D's, from the same poses), ``surface`` (all points, and those that are
written), ``viewer`` and ``report`` (their pages).
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
from pathlib import Path

import draw
import numpy as np
from PIL import Image
from surfaces import FRONT, REVERSE

import nacre
from nacre.cli import main as nacre_command
from nacre.rendering import render_points

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "benchmarks"), str(ROOT / "tests" / "python")]

import cases  # noqa: E402
import mesh_methods  # noqa: E402
from mesh_scenes import STEPS, Laid, Scene  # noqa: E402

MESHED = ["teddy", "d435", "icl"]
METHODS = {
    "nacre": mesh_methods.nacre_open,
    "Open3D, Poisson": mesh_methods.open3d_poisson,
    "Open3D, TSDF": mesh_methods.open3d_tsdf,
}
CLEANED = ["teddy", "d435", "robot", "sr300", "apc", "boxcan"]
SHOWN = ["teddy", "d435", "boxcan", "robot", "sr300", "icl"]
SIDE, BACK = 0.2, 0.3  # of the distance: where the picture is taken, right of the camera, and behind it
PANEL = (300, 225)


def beside(points, pose):
    """Return a camera's pose that was moved aside, towards the same middle of what it saw."""
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    seen = local[(local[:, 2] > 0) & (np.abs(local[:, :2]) < 0.6 * local[:, 2:]).all(axis=1)]
    distance = float(np.median(seen[:, 2]))
    eye = np.array([SIDE, -SIDE / 2, -BACK]) * distance
    forward = np.array([0, 0, distance]) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross([0, 1, 0], forward)
    right /= np.linalg.norm(right)
    moved = np.eye(4)
    moved[:3, :3] = pose[:3, :3] @ np.stack([right, np.cross(forward, right), forward], axis=1)
    moved[:3, 3] = pose[:3, :3] @ eye + pose[:3, 3]
    return moved


def middle_pose(poses):
    """Return the pose in the middle of those that are known."""
    known = [pose for pose in poses if np.isfinite(pose).all()]
    return np.asarray(known[len(known) // 2])


def mesh_panel(laid: Laid, pose, size):
    """Draw a mesh as a camera at a pose sees it, two rays a pixel; reverse sides are brown."""
    width, height = 2 * size[0], 2 * size[1]
    mesh = nacre.Mesh(laid.vertices, laid.triangles)
    v, u = np.mgrid[0:height, 0:width]
    rays = np.stack([u - width / 2 + 0.5, v - height / 2 + 0.5, np.full(u.shape, 1.05 * width)], axis=-1)
    rays = rays.reshape(-1, 3) @ pose[:3, :3].T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hits = mesh.cast(np.tile(pose[:3, 3], (len(rays), 1)), rays)
    is_hit = hits.triangles >= 0
    places = pose[:3, 3] + np.nan_to_num(hits.distances)[:, None] * rays
    corners = np.asarray(mesh.vertices, float)[mesh.triangles[np.maximum(hits.triangles, 0)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = -np.einsum("ij,ij->i", normals, rays) / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)
    base = np.where(facing[:, None] > 0, FRONT, REVERSE)
    if laid.colors is not None:
        rows = np.maximum(hits.triangles, 0)
        colors = laid.colors_at(nacre.ClosestPoints(places, normals, hits.distances, rows))
        base = np.where(facing[:, None] > 0, colors, 0.5 * colors)
    shade = 0.35 + 0.65 * np.abs(facing[:, None])
    pixels = np.where(is_hit[:, None], base * shade, 255.0).reshape(height, width, 3)
    return np.asarray(Image.fromarray(pixels.astype(np.uint8)).resize(size, Image.Resampling.BOX))


def meshes():
    """Draw meshes of the same poses, a row for each recording."""
    panels = []
    for name in MESHED:
        scene = Scene(cases.make(name, every=STEPS.get(name, 1)))
        pose = beside(scene.cloud.points, middle_pose(scene.poses))
        for title, method in METHODS.items():
            panels.append((f"{name}: {title}", mesh_panel(method(scene), pose, PANEL)))
    return draw.sheet(panels, columns=len(METHODS))


def surface():
    """Draw the models of all recordings, all points beside those that are a surface."""
    panels = []
    for name in CLEANED:
        case = cases.make(name, every=STEPS.get(name, 1))
        _, model = cases.run(case, num_threads=0)
        whole, written = model.cloud(all_points=True), model.cloud()
        pose = beside(written.points, middle_pose(model.poses))
        for title, cloud in (("all points", whole), ("written", written)):
            large = draw.View.from_camera(written.points, pose, size=(2 * PANEL[0], 2 * PANEL[1]))
            picture = render_points(cloud.points, cloud.normals, cloud.colors, view=large)
            small = Image.fromarray(picture).resize(PANEL, Image.Resampling.BOX)
            panels.append((f"{name}: {title}", np.asarray(small)))
    return draw.sheet(panels, columns=4)


def runs(folder: Path) -> dict[str, Path]:
    """Reconstruct the recordings that are shown."""
    for name in SHOWN:
        recording, every = cases.DATA / cases.REAL[name][0], str(STEPS.get(name, 1))
        with contextlib.suppress(SystemExit):
            nacre_command(
                ["reconstruct", str(recording), "-o", str(folder / name), "--every", every, "--quiet"]
            )
    return {name: folder / name for name in SHOWN}


def screens(pages: dict[str, str], ready: str):
    """Return what Chromium shows of pages, as a sheet."""
    from browser import Browser

    panels = []
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        Browser(Path(profile)) as browser,
    ):
        for name, address in pages.items():
            browser.open(address)
            browser.wait_for(ready)
            path = Path(profile) / "page.png"
            path.write_bytes(browser.screenshot())
            with Image.open(path) as shot:
                large = shot.convert("RGB")
                size = (600, round(600 * large.height / large.width))
                panels.append((name, np.asarray(large.resize(size, Image.Resampling.LANCZOS))))
    return draw.sheet(panels, columns=2)


def viewer():
    """Draw the first view of the pages of six recordings."""
    with tempfile.TemporaryDirectory() as folder:
        pages = {}
        for name, run in runs(Path(folder)).items():
            page = run / "view.html"
            with contextlib.suppress(SystemExit):
                nacre_command(["view", str(run), "--html", str(page), "--quiet"])
            pages[name] = page.as_uri()
        return screens(pages, "page.clouds.length > 0 && page.clouds[0].version > 1")


def report():
    """Draw the reports of six recordings."""
    with tempfile.TemporaryDirectory() as folder:
        pages = {name: (run / "report.html").as_uri() for name, run in runs(Path(folder)).items()}
        return screens(pages, "document.readyState == 'complete'")


FIGURES = {"meshes": meshes, "surface": surface, "viewer": viewer, "report": report}


def main() -> None:
    """Draw what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[1])
    parser.add_argument("names", nargs="*", metavar="NAME", help="all where none is named")
    parser.add_argument("--data", type=Path, default=cases.DATA, help="where the recordings are")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images", help="folder of the pictures")
    arguments = parser.parse_args()
    cases.DATA = arguments.data
    for name in arguments.names or FIGURES:
        path = arguments.out / f"recordings-{name}.webp"
        draw.save(path, FIGURES[name]())
        print(f"{path}  {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
