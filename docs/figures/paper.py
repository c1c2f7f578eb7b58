"""Figures 3 to 7 of Blackburn, Kubacki and Stratton 2010, as nacre draws them."""

from __future__ import annotations

import draw
import numpy as np
from scenes import Turntable, moved

import nacre

NOISE = 0.0005  # [m]
REASONS = {"edge": draw.RED, "slanted": draw.ORANGE, "isolated": draw.BLUE}


def cleaning(table: Turntable, size, preset="default"):
    """Figure 3: a depth image with edge noise, what is removed, and the points from the side."""
    depth = table.view(0, NOISE, 1.0)
    labels = nacre.label_pixels(depth, table.camera, nacre.ModelParameters.preset(preset).depth)
    seen = np.isfinite(depth)
    v, u = np.nonzero(seen)
    pad = 6
    crop = (slice(max(v.min() - pad, 0), v.max() + pad), slice(max(u.min() - pad, 0), u.max() + pad))
    shown = draw.by_value(-depth, *-np.nanpercentile(depth, (99, 1)))
    removed = np.where(seen[..., None], np.uint8(200), np.uint8(255)).repeat(3, axis=2)
    colors = np.full((*depth.shape, 3), 205, np.uint8)
    for reason, color in REASONS.items():
        mask = labels == nacre.PIXEL_LABELS.index(reason)
        removed[mask] = colors[mask] = draw.category_rgb(color)
    points, kept = nacre.back_project(depth, table.camera), labels[seen] == 0
    view = draw.View.fit(points[kept], "right", size=size)
    pixel = table.camera.pixel_size
    flat = np.tile([1.0, 0.0, 0.0], (len(points), 1))  # no shading
    more = {"view": view, "size": size, "spacing": 0.55 * pixel}
    raw = draw.points_panel(points, flat, colors[seen], **more)
    clean = draw.points_panel(points[kept], flat[kept], colors[seen][kept], **more)
    return draw.sheet(
        [
            ("depth as measured", draw.image_panel(shown, size, crop)),
            ("what is removed", draw.image_panel(removed, size, crop)),
            ("points from the side, before", raw),
            ("and after", clean),
        ],
        columns=2,
    )


def normals(table: Turntable, size):
    """Figure 4: the normals of a noisy view, and how far they are from the truth."""
    points, found = table.cloud(0, NOISE)
    true = table.mesh.closest(moved(points, table.poses[0])).normals @ table.poses[0][:3, :3]
    off = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", true, found), -1, 1)))
    view = draw.View.fit(points, size=size)
    color = ((0.5 - 0.5 * found * [-1, 1, 1]) * 255).astype(np.uint8)
    more = {"view": view, "size": size, "spacing": 1.2 * table.camera.pixel_size}
    return draw.sheet(
        [
            ("shaded by the normals", draw.points_panel(points, found, **more)),
            ("normals as colours", draw.points_panel(points, None, color, **more)),
            (
                f"errors, 0 to 20 degrees, median {np.median(off):.1f}",
                draw.points_panel(points, None, draw.by_value(off, 0, 20), **more),
            ),
        ]
    )


def paper_model_normals(table: Turntable, size):
    """Figure 4 of the preset: the model after some views, whose rims have no normal."""
    points, found = paper_model(table, 4)
    known = np.isfinite(found).all(axis=1)
    true = table.mesh.closest(moved(points, table.poses[0])).normals @ table.poses[0][:3, :3]
    off = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", true[known], found[known]), -1, 1)))
    colors = np.full((len(points), 3), 205, np.uint8)
    colors[known] = ((0.5 - 0.5 * found[known] * [-1, 1, 1]) * 255).astype(np.uint8)
    errors = np.full((len(points), 3), 205, np.uint8)
    errors[known] = draw.by_value(off, 0, 20)
    more = {"view": draw.View.fit(points, size=size), "size": size}
    return draw.sheet(
        [
            ("the model, shaded by the normals", draw.points_panel(points[known], found[known], **more)),
            (f"{np.mean(~known):.0%} without (grey)", draw.points_panel(points, None, colors, **more)),
            (
                f"errors, 0 to 20 degrees, median {np.median(off):.1f}",
                draw.points_panel(points, None, errors, **more),
            ),
        ]
    )


def paper_model(table: Turntable, num_views: int):
    """Return the paper's model after some views, and its normals: of k points within epsilon, or NaN."""
    model = nacre.Model(table.camera, "paper")
    for k in range(num_views):
        model.add_frame(table.view(k, NOISE, 1.0))
    wlop = model.parameters.wlop
    normals = nacre.estimate_normals(model.points, k=wlop.normal_neighbors, max_radius=wlop.normal_radius)
    distances, _ = nacre.KdTree(model.points).query(model.points, k=wlop.normal_neighbors)
    normals[~(distances[:, -1] <= wlop.normal_radius)] = np.nan
    normals[np.einsum("ij,ij->i", normals, model.normals) < 0] *= -1
    return model.points, normals


def registration(table: Turntable, size, preset="default"):
    """Figure 5: two views 30 degrees apart, after so many iterations."""
    target, target_normals = table.cloud(0, NOISE) if preset == "default" else paper_model(table, 1)
    source, source_normals = table.cloud(1, NOISE)
    paper = nacre.ModelParameters.preset("paper").registration
    as_in_paper = {
        name: getattr(paper, name)
        for name in ("method", "max_distance", "max_angle", "sample_fraction", "keep_best")
    }
    panels = []
    view = None
    size = (size[0], size[1] * 2 // 3)
    colors = draw.two_colors(target, source)
    for iterations in (0, 1, 2, 40 if preset == "default" else paper.max_iterations):
        pose = np.eye(4)
        if iterations:
            result = nacre.align(
                source,
                target,
                source_normals=source_normals,
                target_normals=target_normals,
                max_iterations=iterations,
                **({} if preset == "default" else as_in_paper),
            )
            pose, iterations = result.target_from_source, result.iterations
        both = np.concatenate([target, moved(source, pose)])
        facing = np.concatenate([np.nan_to_num(target_normals), source_normals @ pose[:3, :3].T])
        view = view or draw.View.fit(both, "top", size=size)
        off = np.linalg.inv(table.truth(1)) @ pose
        angle = np.degrees(np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1)))
        times = f"{iterations} iteration{'s' if iterations > 1 else ''}"
        caption = f"{times}: {angle:.2g} degrees off" if iterations else "30 degrees apart"
        panel = draw.points_panel(
            both, facing, colors, view=view, size=size, spacing=1.3 * table.camera.pixel_size
        )
        panels.append((caption, panel))
    return draw.sheet(panels, columns=2)


def growing(table: Turntable, sigma: float, size, preset="default", most=0.5):
    """Figures 6 and 7: the model after 1, 4 and all views, and its errors up to so many millimetres."""
    model = nacre.Model(table.camera, preset)
    num_views = len(table.poses)
    shown = []
    for k in range(num_views):
        model.add_frame(table.view(k, sigma, 1.0 if sigma else 0.0))
        if k + 1 not in (1, 4, num_views):
            continue
        errors = table.errors(model.points)
        rms = 1e3 * np.sqrt(np.mean(errors**2))
        caption = f"{k + 1} view{'s' if k else ''}: {len(model.points)} points, RMS {rms:.2f} mm"
        shown.append((caption, model.points, model.normals, None))
    colors = draw.by_value(1e3 * np.abs(errors), 0.0, most)
    shown.append((f"distances from the object, 0 to {most:g} mm", model.points, model.normals, colors))
    view = draw.View.fit(model.points, (-0.6, -0.4, -1), size=size)
    return draw.sheet(
        [(caption, draw.points_panel(*cloud, view=view, size=size)) for caption, *cloud in shown], columns=2
    )
