#!/usr/bin/env python
"""
Draw the pictures of real recordings, which ask for the recordings and Open3D.

``python docs/figures/recordings.py --data FOLDER`` draws all into ``docs/images``. ``meshes``: nacre's beside
Open3D's, from the same poses. ``surfaces``: all points of models, and those that are written. ``screens``:
the viewer and the report as they open. ``dog``: an object on a turntable, from its sides.
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
from pathlib import Path

import draw
import numpy as np
from PIL import Image
from surfaces import FRONT, REVERSE

import nacre
from nacre.meshing import on_surface
from nacre.viewer import export_html, read_timeline

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "benchmarks"), str(ROOT / "tests" / "python")]

import cases  # noqa: E402
import mesh_methods  # noqa: E402
from browser import Browser  # noqa: E402
from mesh_scenes import Laid, Scene, backprojected  # noqa: E402

# Recordings; after which part of the path the picture is taken, how far behind the camera, of the distance.
MESHED = {"teddy": (0.5, 0.5), "d435": (0.5, 0.3), "icl": (0, 0.3), "dog": (0, -0.5)}
METHODS = {
    "nacre": mesh_methods.nacre_open,
    "Open3D, Poisson": mesh_methods.open3d_poisson,
    "Open3D, TSDF": mesh_methods.open3d_tsdf,
}
SIDE = 0.2  # of the distance: how far right of the camera, and half as far above it
PANEL = (300, 225)
KINDS = "depth", "rgb"
DOG_CAMERA = nacre.Camera(640, 480, 616.87, 617.06, 319.57, 233.06)
RECORDINGS = [
    "tum-fr3-teddy",
    "d435-t265-shelf",
    "iphone-lidar-office-a",
    "icl-livingroom-loop-fast",
    "realsense-robot-objects",
    "truedepth-boxcan",
    "tum-fr3-cabinet-kf",
    "sr300-shelf",
    "apc-shelf-f200",
    "tum-fr1-rpy",
]
SHOWN = 6  # of them, whose screens are drawn
LOADED = "page.clouds.length > 0 && page.clouds[0].version > 1"
PAGE, VIEW = (1200, 657), (900, 657)  # pixels; beside the view are the viewer's tools
WIDTH = {PAGE: 480, VIEW: 370}  # of their pictures
QUALITY = 60  # of the files, which stay below 150 kB


def beside(points, pose, back):
    """Return a camera's pose that was moved aside and back, towards the same middle of what it saw."""
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    seen = local[(local[:, 2] > 0) & (np.abs(local[:, :2]) < 0.6 * local[:, 2:]).all(axis=1)]
    middle = np.median(seen, axis=0)
    eye = np.array([SIDE, -SIDE / 2, -back]) * middle[2]
    forward = middle - eye
    forward /= np.linalg.norm(forward)
    right = np.cross([0, 1, 0], forward)
    right /= np.linalg.norm(right)
    moved = np.eye(4)
    moved[:3, :3] = pose[:3, :3] @ np.stack([right, np.cross(forward, right), forward], axis=1)
    moved[:3, 3] = pose[:3, :3] @ eye + pose[:3, 3]
    return moved


def pose_after(part, poses):
    """Return the pose after a part of those that are known."""
    known = [pose for pose in poses if np.isfinite(pose).all()]
    return np.asarray(known[int(part * len(known))])


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
    for name, (part, back) in MESHED.items():
        scene = toy() if name == "dog" else Scene(cases.make(name))
        pose = beside(scene.cloud.points, pose_after(part, scene.poses), back)
        for title, method in METHODS.items():
            panels.append((f"{name}: {title}", mesh_panel(method(scene), pose, PANEL)))
    return draw.sheet(panels, columns=len(METHODS))


def reconstructed(name, folder, *options):
    """Reconstruct a recording; where few frames are tracked that is shown, too."""
    command = [
        Path(sys.executable).with_name("nacre"),
        "reconstruct",
        cases.DATA / name,
        "-o",
        folder,
        *options,
    ]
    code = subprocess.run(command, check=False, stdout=subprocess.DEVNULL).returncode
    assert code in (0, 3), command
    return folder


def photograph(browser, page, size, loaded="true"):
    """Return a page as the browser shows it, smaller."""
    browser.open(page.as_uri())
    browser.wait_for(loaded)
    picture = Image.open(io.BytesIO(browser.screenshot())).convert("RGB")
    picture = picture.crop((0, 0, *size))
    width = WIDTH[size]
    return np.asarray(picture.resize((width, width * size[1] // size[0]), Image.Resampling.LANCZOS))


def thickness(points):
    """Return how thick a surface of points is, from each with its 16 nearest: mean, and for 95 % [mm]."""
    neighbors = points[nacre.KdTree(points).query(points, 17)[1]].astype(float)
    away = neighbors - neighbors.mean(axis=1, keepdims=True)
    least = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", away, away) / 17)[:, 0]
    thick = 1000 * np.sqrt(np.maximum(least, 0))
    return f"{thick.mean():.2f}, {np.quantile(thick, 0.95):.1f}"


def surfaces():
    """Draw models with all their points and as they are written, side by side; print how thick they are."""
    panels = []
    with tempfile.TemporaryDirectory() as scratch, Browser(Path(scratch) / "profile") as browser:
        for name in RECORDINGS:
            out = reconstructed(name, Path(scratch) / name, "--all-points", "--no-report")
            cloud = nacre.read_points(out / "model.ply")
            written = cloud[on_surface(cloud.points, cloud.normals, cloud.attributes["confidence"])]
            part = 1 - len(written) / len(cloud)
            thick = f"{thickness(cloud.points)} | {thickness(written.points)}"
            print(f"| {name} | {part:.1%} | {thick} |", flush=True)
            for title, points in (("all points", cloud), ("as written", written)):
                nacre.write_points(out / "model.ply", points)
                export_html(read_timeline(out), out / "page.html")
                panels.append((f"{name}: {title}", photograph(browser, out / "page.html", VIEW, LOADED)))
    return draw.sheet(panels, columns=2)


def screens():
    """Draw the viewer and the report as they open, a row for each recording."""
    panels = []
    with tempfile.TemporaryDirectory() as scratch, Browser(Path(scratch) / "profile") as browser:
        for name in RECORDINGS[:SHOWN]:
            out = reconstructed(name, Path(scratch) / name)
            export_html(read_timeline(out), out / "page.html")
            panels.append((f"{name}: the viewer", photograph(browser, out / "page.html", PAGE, LOADED)))
            panels.append((f"{name}: the report", photograph(browser, out / "report.html", PAGE)))
    return draw.sheet(panels, columns=2)


def six_views():
    """Return the recording of a toy on a turntable, far apart."""
    folder = cases.DATA / "realsense-turntable-dog" / "data1"
    images = {kind: [np.asarray(Image.open(folder / f"{kind}_{i}.png")) for i in range(6)] for kind in KINDS}
    depths = [depth.astype(np.float32) / 1000 for depth in images["depth"]]
    return cases.Case("dog", DOG_CAMERA, depths, [color[..., :3] for color in images["rgb"]], [None] * 6)


def toy():
    """Return the toy alone, as nacre found it; of the images, too, what lies near its points."""
    scene = Scene(six_views(), region={"object": True})
    scene.more_than = 0.0  # most of it is in one or two images
    tree = nacre.KdTree(scene.cloud.points)
    for depth, pose in zip(scene.depths, scene.poses, strict=True):
        points, pixels = backprojected(depth, scene.camera)
        points = points @ pose[:3, :3].T + pose[:3, 3]
        is_far = tree.query(points, 1)[0] > 3 * scene.spacing
        depth[tuple(rows[is_far] for rows in pixels)] = np.nan
    return scene


def dog():
    """Draw a toy of which six views, far apart, were joined, from four sides."""
    _, model = cases.run(six_views(), region={"object": True})
    cloud = model.cloud()
    size, spacing = (360, 360), 1.5 * model.spacing
    more = {"hide_reverse": True, "spacing": spacing, "size": size}
    panels = []
    for side in ("front", "right", "back", "left"):
        picture = draw.points_panel(cloud.points, cloud.normals, cloud.colors, view_from=side, **more)
        panels.append((side, picture))
    return draw.sheet(panels)


FIGURES = {"meshes": meshes, "surfaces": surfaces, "screens": screens, "dog": dog}


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
        draw.save(path, FIGURES[name](), QUALITY)
        print(f"{path}  {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
