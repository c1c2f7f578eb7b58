"""
Grow a model from a recording, or from the built-in object where none is given.

    python examples/python/reconstruct.py [RECORDING] [MODEL.ply]
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import nacre


def recorded(path: str) -> Iterator[nacre.SequenceFrame]:
    """Yield the frames of a recording of any known format."""
    yield from nacre.open_sequence(path)


def simulated(num_views: int = 12) -> Iterator[nacre.SequenceFrame]:
    """Yield noisy views of the built-in object on a turntable."""
    mesh = nacre.built_in_object()
    camera = nacre.default_camera(mesh, "orthographic")
    for index, pose in enumerate(nacre.turntable_poses(mesh, num_views, camera=camera)):
        depth = mesh.simulate_depth(camera, pose, noise=0.0005, edge_mixing=True, seed=index)
        yield nacre.SequenceFrame(index, depth, camera, timestamp=None, color=None, truth=pose)


def main(arguments: list[str]) -> None:
    """Reconstruct and write the model."""
    frames = recorded(arguments[0]) if arguments else simulated()
    target = arguments[1] if len(arguments) > 1 else "model.ply"
    model: nacre.Model | None = None
    for frame in frames:
        if model is None:
            model = nacre.Model(frame.camera)
        report = model.add_frame(frame.depth, color=frame.color, timestamp=frame.timestamp)
        print(report)
    if model is None:
        sys.exit("the recording has no frames")
    nacre.write_points(target, model.points, normals=model.normals, colors=model.colors)
    print(f"{model} -> {target}")


if __name__ == "__main__":
    main(sys.argv[1:])
