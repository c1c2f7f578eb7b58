#!/usr/bin/env python
"""
Draw the pictures of the documentation.

``python docs/figures/make.py`` draws all into ``docs/images``, ``python docs/figures/make.py normals`` one;
``--mesh FILE`` takes another object than the built-in one.
"""

from __future__ import annotations

import argparse
import functools
from pathlib import Path

import draw
import paper
import steps
import surfaces
from scenes import Turntable

import nacre

IMAGES = Path(__file__).resolve().parents[1] / "images"


def figures(mesh: nacre.Mesh, small: bool = False):
    """Return what draws each figure, by name; small ones are quick to make and show the same."""
    table = Turntable.around(mesh, 4 if small else 12, 30.0, small)
    size = (120, 120) if small else (360, 330)
    each = {
        "cleaning": paper.cleaning,
        "normals": paper.normals,
        "registration": paper.registration,
        "model-noiseless": functools.partial(paper.growing, sigma=0.0),
        "model-noisy": functools.partial(paper.growing, sigma=paper.NOISE),
        "paper-cleaning": functools.partial(paper.cleaning, preset="paper"),
        "paper-normals": paper.paper_model_normals,
        "paper-registration": functools.partial(paper.registration, preset="paper"),
        "paper-model-noiseless": functools.partial(paper.growing, sigma=0.0, preset="paper", most=3.0),
        "paper-model-noisy": functools.partial(paper.growing, sigma=paper.NOISE, preset="paper", most=3.0),
        **steps.FIGURES,
        **surfaces.FIGURES,
    }
    return {name: functools.partial(draw_one, table, size=size) for name, draw_one in each.items()}


def main() -> None:
    """Draw what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="which figures; all where none is named")
    parser.add_argument("--mesh", type=Path, help="the object, a mesh in metres")
    parser.add_argument("--out", type=Path, default=IMAGES, help="folder of the pictures")
    parser.add_argument("--prefix", default="", help="of the files' names")
    parser.add_argument("--small", action="store_true", help="few and coarse views, small pictures")
    arguments = parser.parse_args()
    mesh = nacre.built_in_object() if arguments.mesh is None else nacre.read_mesh(arguments.mesh)
    all_figures = figures(mesh, arguments.small)
    unknown = set(arguments.names) - set(all_figures)
    if unknown:
        parser.error(f"there is no figure {', '.join(sorted(unknown))}; there are {', '.join(all_figures)}")
    for name in arguments.names or all_figures:
        path = arguments.out / f"{arguments.prefix}{name}.webp"
        draw.save(path, all_figures[name]())
        print(f"{path}  {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
