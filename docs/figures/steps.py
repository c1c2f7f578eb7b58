"""A picture for each of the other steps."""

from __future__ import annotations

import re
from pathlib import Path

import draw
import numpy as np
import scenes
from scenes import Turntable, moved

import nacre

NOISE = 0.0005  # [m]


def demo(table: Turntable, size):
    """Draw a noisy depth image, and the model after 1, 4 and all views, from aside."""
    model, num_views = nacre.Model(table.camera), len(table.poses)
    depth = table.view(0, NOISE, 1.0)
    seen = np.argwhere(np.isfinite(depth))
    (top, left), (bottom, right) = seen.min(axis=0), seen.max(axis=0) + 1
    shades = draw.by_value(-depth, -np.nanmax(depth), -np.nanmin(depth))[top:bottom, left:right]
    panels, shown = [("a depth image", draw.image_panel(shades, size))], []
    for k in range(num_views):
        model.add_frame(table.view(k, NOISE, 1.0))
        if k + 1 in (1, 4, num_views):
            cloud = model.cloud()
            shown.append((f"{k + 1} view{'s' if k else ''}", cloud.points, cloud.normals))
    view = draw.View.fit(cloud.points, (0.8, -0.4, -0.8), size=size, outliers=0)
    panels += [(caption, draw.points_panel(*points, view=view, size=size)) for caption, *points in shown]
    return draw.sheet(panels)


def noise(table: Turntable, size):
    """Draw the noise models of sensors, and what is measured from images with the Kinect's."""
    z = np.linspace(0.5, 4.0, 60)
    models = [
        ("structured light (Kinect)", nacre.NoiseModel.kinect()),
        ("stereo (D435, fx 616)", nacre.NoiseModel.stereo(616)),
        ("time of flight (Kinect v2)", nacre.NoiseModel.time_of_flight()),
    ]
    curves = [draw.Curve(name, z, 1e3 * model.sigma(z), i) for i, (name, model) in enumerate(models)]
    room = scenes.furnished_room()
    camera = nacre.Camera(208, 156, 180.0, 180.0, 103.5, 77.5)
    images = [room.simulate_depth(camera, scenes.walk_around(k, 6), noise="kinect", seed=k) for k in range(6)]
    found = nacre.calibrate_noise(images, camera)
    at = np.linspace(0.5, 4.0, 15)
    curves.append(draw.Curve("found in six images of the first", at, 1e3 * found.sigma(at), draw.RED, "dots"))
    large = (size[0] * 3 // 2, size[1])
    return draw.chart(curves, x_label="depth [m]", y_label="sigma [mm]", size=large)


def weak(table: Turntable, size):
    """Draw what ICP says of shapes that leave directions open: where their points may go."""
    num = 4000 if size[0] < 200 else 30000
    random = np.random.default_rng(0)
    u, v = random.uniform(-1, 1, (2, num))
    sphere = np.column_stack(
        [np.sqrt(1 - v**2) * np.cos(3 * u), v, -np.sqrt(1 - v**2) * np.abs(np.sin(3 * u))]
    )
    pipe = np.column_stack([np.sin(1.4 * u), 1.3 * v, -np.cos(1.4 * u)])
    shapes = {
        "a wall": (np.column_stack([u, v, 0 * u]), np.tile([0.0, 0, -1], (num, 1))),
        "a pipe": (pipe, pipe * [1, 0, 1]),
        "a ball": (sphere, sphere),
        "an object": table.cloud(0),
    }
    panels = []
    for name, (points, normals) in shapes.items():
        points = points * (0.1 if name != "an object" else 1.0)
        thin = random.choice(len(points), min(len(points), num // 3), replace=False)
        result = nacre.align(
            points[thin], points, source_normals=normals[thin], target_normals=normals, final_distance=0.01
        )
        count = len(result.weak_directions)
        cloud, facing, colors = _streaks(points, normals, result)
        panel = draw.points_panel(
            cloud, facing, colors, size=size, view_from=(-0.35, -0.45, -1), spacing=_sizes(points, colors)
        )
        panels.append((f"{name}: {count or 'no'} direction{'' if count == 1 else 's'} open", panel))
    return draw.sheet(panels, columns=2)


def _streaks(points, normals, result):
    """Return a grey cloud with short lines along which some of its points may slide."""
    step = max(1, len(points) // 60)
    extent = np.sqrt(np.mean(np.sum((points - result.center) ** 2, axis=1)))
    cloud, facing = [points], [normals]
    colors = [np.full((len(points), 3), 190, np.uint8)]
    for number, twist in enumerate(result.weak_directions):
        p, n = points[number * 7 :: step], normals[number * 7 :: step]
        way = np.cross(twist[:3] / extent, p - result.center) + twist[3:]
        for part in np.linspace(-1, 1, 41):
            cloud.append(p + 0.12 * extent * part * way + 0.01 * extent * n)
            facing.append(n)
            color = draw.category_rgb((draw.BLUE, draw.RED, draw.GREEN, draw.PINK)[number])
            colors.append(np.tile(color, (len(p), 1)))
    return np.concatenate(cloud), np.concatenate(facing), np.concatenate(colors)


def _sizes(points, colors):
    wide = float(np.median(nacre.KdTree(points).query(points, k=5)[0][:, -1]))
    return np.where(np.arange(len(colors)) < len(points), 1.5 * wide, 0.006 * np.ptp(points, axis=0).max())


def anywhere(table: Turntable, size):
    """Draw two views 60 degrees apart, one of them turned over, before and after the search."""
    last = 2
    target, target_normals = table.cloud(0, NOISE)
    source, source_normals = table.cloud(last, NOISE)
    between = -(table.truth(0)[:3, 2] + table.truth(last)[:3, 2]) - (0, 0.4, 0)
    away = scenes.rotation((1, 2, 0.5), 2.5)
    away[:3, 3] = target.mean(axis=0) - moved(source, away).mean(axis=0) + [0.1, -0.03, 0]
    source, source_normals = moved(source, away), source_normals @ away[:3, :3].T
    # An orthographic camera sees along its axis: a viewpoint far away.
    far = 100.0
    result = nacre.align_global(
        source,
        target,
        source_normals=source_normals,
        target_normals=target_normals,
        source_viewpoint=moved(np.array([[0, 0, -far]]), away)[0],
        target_viewpoint=(0, 0, -far),
    )
    panels = []
    for caption, pose in (
        (f"two views {30 * last} degrees apart, one turned over", np.eye(4)),
        (f"{result.status}, overlap {result.overlap:.2f}", result.target_from_source),
    ):
        both = np.concatenate([target, moved(source, pose)])
        facing = np.concatenate([target_normals, source_normals @ pose[:3, :3].T])
        colors = draw.two_colors(target, source)
        more = {"view_from": between, "spacing": 1.4 * table.camera.pixel_size}
        panels.append((caption, draw.points_panel(both, facing, colors, size=size, **more)))
    return draw.sheet(panels)


def acceptance(table: Turntable, size):
    """Draw the registration score of frames, among them three of another object."""
    around = Turntable.around(table.mesh, 24, 15.0, small=size[0] < 200)
    low, high = table.mesh.bounds
    other = scenes.joined([scenes.box((low + high) / 2, 0.6 * (high - low), 0.5)])
    wrong = range(9, 12)
    model = nacre.Model(around.camera)
    for k in range(len(around.poses)):
        if k in wrong:
            depth = other.simulate_depth(around.camera, around.poses[k], noise=NOISE, seed=k)
        else:
            depth = around.view(k, NOISE, 1.0)
        model.add_frame(depth)
    states = {"TRACKED": draw.BLUE, "RELOCALISED": draw.GREEN, "WEAK": draw.ORANGE, "LOST": draw.RED}
    curves = []
    for name, color in states.items():
        chosen = [frame for frame in model.frames[1:] if frame.status == name]
        if chosen:
            at, score = [frame.index for frame in chosen], [frame.score for frame in chosen]
            curves.append(draw.Curve(name, at, score, color, "dots"))
    least = nacre.ModelParameters().min_score
    return draw.chart(
        curves,
        x_label="frame",
        y_label="registration score",
        size=(size[0] * 3 // 2, size[1]),
        level=(least, "min_score"),
    )


def confidence(table: Turntable, size):
    """Draw how a model's confidence grows, and its error shrinks."""
    model = nacre.Model(table.camera, loop_closure=False)
    frames, rms = [], []
    for k in range(len(table.poses)):
        # Again and again the first two views: their surface becomes ever more certain.
        pose = k % 2
        depth = table.mesh.simulate_depth(table.camera, table.poses[pose], noise=2 * NOISE, seed=k)
        model.add_frame(depth, guess=table.truth(pose), keep_guess=True)
        frames.append(k + 1)
        rms.append(1e3 * float(np.median(np.abs(table.errors(model.points))) * 1.4826))
    colors = draw.by_value(model.confidence, *np.percentile(model.confidence, (2, 98)))
    panel = draw.points_panel(model.points, model.normals, colors, size=size, view_from=(-0.6, -0.4, -1))
    curves = [
        draw.Curve("a single pixel", frames, [2e3 * NOISE] * len(frames), draw.GREY),
        draw.Curve("the model's points", frames, rms, draw.BLUE, "both"),
    ]
    errors = draw.chart(curves, x_label="frames", y_label="robust error [mm]", size=size)
    return draw.sheet([("confidence, dark to bright", panel), ("errors against frames", errors)])


def consolidation(table: Turntable, size):
    """Draw many noisy points, and what the forms of WLOP make of them."""
    clouds = [moved(table.cloud(k, 2 * NOISE)[0], table.truth(k)) for k in range(len(table.poses))]
    points = np.concatenate(clouds)
    view = draw.View.fit(points, (-0.6, -0.4, -1), size=size)
    panels = [_consolidated(table, points[:: max(1, len(points) // 4000)], "4000 of the input", view, size)]
    for method, words in (("wlop", "wlop"), ("wlop+", "wlop+"), ("cgal", "cgal")):
        result = nacre.consolidate(points, radius=0.008, num_points=4000, method=method)
        panels.append(_consolidated(table, result.points, words, view, size))
    return draw.sheet(panels, columns=2)


def _consolidated(table, points, words, view, size):
    errors = table.errors(points)
    apart = nacre.KdTree(points).query(points, k=2)[0][:, 1]
    rms, uneven = 1e3 * np.sqrt(np.mean(errors**2)), apart.std() / apart.mean()
    colors = draw.by_value(1e3 * np.abs(errors), 0.0, 2.0)
    flat = np.tile(-view.view_from_model[2], (len(points), 1))
    facing = table.mesh.closest(moved(points, table.poses[0])).normals @ table.poses[0][:3, :3]
    seen = facing @ view.view_from_model[2] < 0
    panel = draw.points_panel(points[seen], flat[seen], colors[seen], view=view, size=size, spacing=0.0009)
    return f"{words}: RMS {rms:.2f} mm, unevenness {uneven:.2f}", panel


def loops(table: Turntable, size):
    """Draw the errors of a camera that turns around in a room, with and without loop closure."""
    small = size[0] < 200
    turn = 24 if small else 72
    num_frames = turn + (2 if small else 6)
    room = scenes.furnished_room()
    true, wrong = (nacre.Camera(208, 156, f, f, 103.5, 77.5) for f in (180.0, 182.7))
    poses = [scenes.walk_around(k, turn) for k in range(num_frames)]
    views = [room.simulate_depth(true, pose, noise="kinect", seed=k) for k, pose in enumerate(poses)]
    truth = np.linalg.inv(poses[0]) @ np.array(poses)
    curves = []
    for closing, name, color in ((False, "without", draw.RED), (True, "with loop closure", draw.BLUE)):
        model = nacre.Model(wrong, loop_closure=closing)
        for view in views:
            model.add_frame(view)
        off = 1e3 * np.linalg.norm(model.poses[:, :3, 3] - truth[:, :3, 3], axis=1)
        curves.append(draw.Curve(name, range(num_frames), off, color))
    return draw.chart(
        curves, x_label="frame", y_label="error of the position [mm]", size=(size[0] * 3 // 2, size[1])
    )


def region(table: Turntable, size):
    """Draw an object on a table before a wall, and what the object mode takes of it."""
    scene, pose = scenes.on_a_table(table.mesh)
    scale = 4 if size[0] < 200 else 2
    camera = nacre.Camera(640 // scale, 480 // scale, 525 / scale, 525 / scale, 319.5 / scale, 239.5 / scale)
    depth = scene.simulate_depth(camera, pose, noise=0.001, edge_mixing=1.0)
    clean = nacre.preprocess_depth(depth, camera)
    mask, report = nacre.select_region(clean, camera, object=True, return_report=True)
    shown = draw.by_value(-depth, *-np.nanpercentile(depth, (99, 1)))
    points = nacre.back_project(np.where(np.isfinite(depth), depth, np.nan), camera)
    parts = np.full((*depth.shape, 3), 255, np.uint8)
    parts[np.isfinite(clean)] = 200
    flat = parts[np.isfinite(depth)]
    distances = np.abs(points @ report.planes[:, :3].T - report.planes[:, 3])
    for number in range(len(report.planes)):
        on = (distances.argmin(axis=1) == number) & (distances[:, number] < 0.01)
        flat[on] = draw.category_rgb((draw.SKY, draw.GREEN, draw.PINK)[number % 3])
    parts[np.isfinite(depth)] = flat
    parts[mask] = draw.category_rgb(draw.ORANGE)
    size = (size[0], size[0] * 3 // 4)
    return draw.sheet(
        [
            ("depth", draw.image_panel(shown, size)),
            ("planes put aside, and the object", draw.image_panel(parts, size)),
        ]
    )


def neighbours(table: Turntable, size):
    """Draw the 64, 1024 and 8192 nearest neighbours of a point."""
    mesh = table.mesh
    points = np.concatenate([moved(table.cloud(k)[0], table.truth(k)) for k in range(len(table.poses))])
    facing = mesh.closest(moved(points, table.poses[0])).normals @ table.poses[0][:3, :3]
    tree = nacre.KdTree(points)
    start = points[
        np.argmin(
            np.linalg.norm(
                points - [np.percentile(points[:, i], part) for i, part in enumerate((30, 35, 1))], axis=1
            )
        )
    ]
    colors = np.full((len(points), 3), 215, np.uint8)
    for k, color in ((8192, draw.SKY), (1024, draw.ORANGE), (64, draw.RED)):
        _, near = tree.query(start[None], k=min(k, len(points)))
        colors[near[0]] = draw.category_rgb(color)
    return draw.points_panel(points, facing, colors, size=size, view_from=(-0.6, -0.4, -1))


def worse(table: Turntable, size):
    """Draw how many frames of worse images are right, in all recordings of a table of docs/limits.md."""
    text = (Path(__file__).parents[1] / "limits.md").read_text(encoding="utf-8")
    text = text.partition("### Beside peers")[2].partition("\n## ")[0]
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")]
    heads, _, *rows = lines
    names = list(dict.fromkeys(head.partition(": ")[2] for head in heads[1:]))
    colors = (draw.BLUE, draw.ORANGE, draw.GREEN, draw.PINK)
    panels = []
    for kind in ("times its noise added", "% of the pixels missing"):
        chosen = [rows[0], *(row for row in rows if kind in row[0])]
        x = [0.0, *(float(row[0].split()[0]) for row in chosen[1:])]
        right = np.array([[int(re.search(r"/ (\d+)", cell)[1]) for cell in row[1:]] for row in chosen])
        curves = [
            draw.Curve(name, x, right[:, k :: len(names)].sum(axis=1), colors[k], "both")
            for k, name in enumerate(names)
        ]
        panels.append(
            (
                "",
                draw.chart(
                    curves, x_label=kind, y_label="right frames", limits=(0, x[-1], 0, 270), size=size
                ),
            )
        )
    return draw.sheet(panels)


FIGURES = {
    "demo": demo,
    "noise": noise,
    "weak": weak,
    "anywhere": anywhere,
    "acceptance": acceptance,
    "confidence": confidence,
    "consolidation": consolidation,
    "loops": loops,
    "region": region,
    "neighbours": neighbours,
    "worse": worse,
}
