#!/usr/bin/env python3
"""
Send random frames through models with random cameras and parameters, and check what comes of each.

Depth is all 0, the largest value, NaN, inf, one pixel, blocks, noise, any bits, planes, views of an object,
whole or spoilt; sizes from 1x1 up, both camera models, distortion, colours, masks, attributes, guesses, and
every way to fuse. Each frame must get a status, or a ValueError that is documented, after which nothing
has changed; the model stays finite, with unit normals, and within its bound; saved and loaded it is the same.
"""

from __future__ import annotations

import argparse
import collections
import faulthandler
import functools
import hashlib
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]

STATUSES = {"TRACKED", "WEAK", "LOST", "RELOCALISED"}
REFUSALS = ("depth must be in metres with a median", "depth_scale must be the stored units per metre")
SLOWEST = 120.0  # seconds a model may take before the run is ended with a traceback


class BrokenPromiseError(AssertionError):
    """A frame after which something is not as promised."""


def expect(condition: Any, what: str) -> None:
    """Raise where a promise does not hold."""
    if not condition:
        raise BrokenPromiseError(what)


@functools.cache
def thing() -> nacre.Mesh:
    """Return the object that some frames show."""
    return nacre.built_in_object()


def random_size(rng: np.random.Generator, largest: int) -> tuple[int, int]:
    """Return (width, height): mostly small, some a row or a column."""
    if rng.random() < 0.08:
        sizes = [(1, 1), (1, 50), (50, 1), (2, 2), (3, 3), (5, 4), (7, 200), (16, 16), (17, 15)]
        return sizes[rng.integers(len(sizes))]
    width = int(math.exp(rng.uniform(math.log(12), math.log(largest))))
    return width, max(1, min(largest, int(width * math.exp(rng.normal(-0.3, 0.3)))))


def random_camera(rng: np.random.Generator, width: int, height: int) -> nacre.Camera:
    """Return a camera of either model; the object is some 0.15 m long."""
    if rng.random() < 0.3:
        return nacre.Camera.orthographic(width, height, 0.15 / width * math.exp(rng.normal(0, 0.4)))
    focal = width * math.exp(rng.normal(0.7, 0.4))
    cx, cy = (width - 1) / 2 + rng.normal(0, 2), (height - 1) / 2 + rng.normal(0, 2)
    distortion = rng.normal(0, [0.2, 0.2, 0.01, 0.01, 0.1]) if rng.random() < 0.3 else np.zeros(5)
    if rng.random() < 0.05:
        focal, cx, distortion = (
            focal * 10 ** rng.uniform(-3, 3),
            cx * 10 ** rng.uniform(0, 4),
            distortion * 30,
        )
    depth = "radial" if rng.random() < 0.2 else "z"
    sign = -1 if rng.random() < 0.03 else 1
    return nacre.Camera(width, height, focal, sign * focal, cx, cy, distortion=list(distortion), depth=depth)


def _log(low: float, high: float) -> Any:
    return lambda rng: 10 ** rng.uniform(low, high)


def _one_of(*values: Any) -> Any:
    return lambda rng: values[rng.integers(len(values))]


def _between(low: float, high: float) -> Any:
    return lambda rng: rng.uniform(low, high)


def _whole(low: int, high: int) -> Any:
    return lambda rng: int(rng.integers(low, high + 1))


# What each parameter may be; a fifth of them is changed in half of the models.
PARAMETERS: dict[str, Any] = {
    "fusion_method": _one_of("fuse", "wlop", "wlop+"),
    "binning": _one_of(0, 1, 2, 3, 7),
    "spacing": _one_of(0.0, 1e-30, 1e-6, 1e-4, 0.001, 0.003, 0.01, 0.1, 10.0, 1e6, 1e29),
    "max_points": _one_of(100, 101, 500, 2000, 2**31 - 1),
    "predict_motion": _one_of(True, False),
    "relocalise": _one_of(True, False),
    "loop_closure": _one_of(True, False),
    "denoise_samples": _one_of(True, False),
    "verify": _one_of(True, False),
    "min_score": _one_of(0.0, 0.1, 0.3, 3.0, math.inf),
    "wlop.first_fraction": _one_of(1e-9, 0.01, 0.5, 1.0),
    "wlop.kept_fraction": _one_of(1e-9, 0.1, 0.9, 1.0),
    "wlop.new_fraction": _one_of(0.0, 1e-9, 0.2, 1.0),
    "num_threads": _one_of(1, 1, 2, 3, 7),
    "depth.edge_test": _one_of("inverse_depth", "gradient", "none"),
    "depth.min_depth": _one_of(0.0, 1e-30, 0.1, 0.3, 5.0),
    "depth.max_depth": _one_of(6.0, 20.0, math.inf),
    "depth.gradient_threshold": _log(-6, 2),
    "depth.edge_dilation": _whole(0, 100),
    "depth.edge_sigmas": _log(-3, 3),
    "depth.planar_keep_sigmas": _one_of(0.0, 1.0, 3.0, 1e9),
    "depth.max_slant": _between(0.01, 1.57),
    "depth.max_missing": _one_of(0.0, 0.3, 0.6, 1.0),
    "depth.min_component": _one_of(0, 1, 20, 1000, 2**31 - 1),
    "depth.noise": _one_of(
        None, "kinect", "tof", nacre.NoiseModel(0.001, shared=0.5), nacre.NoiseModel(), nacre.NoiseModel(10.0)
    ),
    "region.object": _one_of(True, False),
    "region.min_x": _one_of(-math.inf, -0.05, -1e30),
    "region.max_z": _one_of(math.inf, 0.5, 2.0),
    "region.min_object": _between(0.0001, 1.0),
    "region.plane_margin": _one_of(0.0, 1e-9, 0.01, 1e9),
    "registration.method": _one_of("symmetric", "point_to_plane", "point_to_point", "paper"),
    "registration.max_iterations": _whole(1, 60),
    "registration.max_distance": _one_of(0.0, 1e-9, 0.01, 1e9),
    "registration.final_distance": _one_of(0.0, 1e-9, 0.01, 1e9),
    "registration.gate_decay": _between(0.01, 1.0),
    "registration.max_angle": _one_of(1e-6, 0.5, 3.2, math.inf),
    "registration.robust": _one_of(True, False),
    "registration.sample_fraction": _between(0.001, 1.0),
    "registration.max_points": _one_of(0, 1, 100, 2**31 - 1),
    "registration.max_samples": _one_of(0, 1, 100, 2**31 - 1),
    "registration.coarse_samples": _one_of(0, 1, 100, 2**31 - 1),
    "registration.keep_best": _one_of(True, False),
    "registration.weak_threshold": _one_of(0.0, 0.002, 0.5, 1e9),
    "registration.seed": _whole(0, 2**31 - 1),
    "fusion.max_confidence": _log(-6, 30),
    "fusion.min_observations": _whole(0, 255),
    "fusion.max_free_space_violations": _whole(1, 255),
    "fusion.reference_sigma": _one_of(0.0, 1e-12, 0.001, 1e9),
    "wlop.radius": _one_of(1e-12, 1e-4, 0.008, 0.1, 1e12),
    "wlop.iterations": _whole(0, 12),
    "wlop.mu": _between(0.0, 0.5),
    "wlop.theta": _one_of("huang", "printed"),
    "wlop.normal_neighbors": _whole(3, 60),
    "wlop.normal_radius": _one_of(1e-9, 0.008, 1.0, math.inf),
}


def random_changes(rng: np.random.Generator) -> dict[str, Any]:
    """Return parameters to change."""
    if rng.random() < 0.5:
        return (
            {"num_threads": 1, "fusion_method": PARAMETERS["fusion_method"](rng)}
            if rng.random() < 0.4
            else {"num_threads": 1}
        )
    return {"num_threads": 1} | {name: draw(rng) for name, draw in PARAMETERS.items() if rng.random() < 0.2}


class Scene:
    """What the frames of one model show."""

    def __init__(self, rng: np.random.Generator, camera: nacre.Camera) -> None:
        self.rng, self.camera = rng, camera
        self.shape = (camera.height, camera.width)
        self.angle, self.step = 0.0, rng.choice([0.0, 0.02, 0.05, 0.1, 0.5])
        self.distance = 0.35 * math.exp(rng.normal(0, 0.3))
        self.wild = rng.random()  # how often a frame is none of the object

    def pose(self) -> Array:
        """Return the next pose around the object."""
        self.angle += self.step
        pose: Array = nacre.turntable_poses(thing(), 2, self.angle, distance=self.distance)[1]
        return pose

    def next(self) -> tuple[str, Array]:
        """Return the kind of frame and its depth [m]."""
        if self.rng.random() > 0.5 * self.wild:
            kind = self.rng.choice(
                ["object", "object", "noisy", "spoilt", "waves", "waves", "waves", "plane"]
            )
        else:
            kind = self.rng.choice(
                [
                    "zeros",
                    "largest",
                    "nan",
                    "inf",
                    "negative",
                    "pixel",
                    "blocks",
                    "noise",
                    "wide",
                    "bits",
                    "spikes",
                ]
            )
        return str(kind), getattr(self, "_" + str(kind))()

    def _object(self) -> Array:
        return thing().simulate_depth(self.camera, self.pose(), num_threads=1)

    def _noisy(self) -> Array:
        return thing().simulate_depth(
            self.camera, self.pose(), noise=10 ** self.rng.uniform(-5, -1), edge_mixing=1.0,
            dropout=self.rng.uniform(0, 1), quantization=self.rng.choice([0.0, 0.001, 0.05]),
            seed=int(self.rng.integers(2**31)), num_threads=1,
        )  # fmt: skip

    def _spoilt(self) -> Array:
        depth = (self._object() if self.rng.random() < 0.5 else self._waves()).astype(np.float32)
        for value in self.rng.choice([np.nan, np.inf, 0.0, -1.0, 1e-30, 1e-42, 1e30, 3e38, 0.3], 3):
            v, u = self.rng.integers(0, self.shape[0]), self.rng.integers(0, self.shape[1])
            depth[v : v + int(self.rng.integers(1, 9)), u : u + int(self.rng.integers(1, 9))] = value
        return depth

    def _plane(self) -> Array:
        v, u = np.indices(self.shape)
        a, b = self.rng.normal(0, 0.2, 2)
        plane: Array = 1.0 + a * u / self.shape[1] + b * v / self.shape[0]
        return plane

    def _waves(self) -> Array:
        v, u = np.indices(self.shape) / max(self.shape)
        self.angle += self.step
        x = u + self.angle / 10
        waves: Array = 0.5 + 0.02 * np.sin(9 * x) * np.cos(7 * v) + 0.01 * np.sin(15 * v + 4 * x) + 0.1 * v
        return waves

    def _zeros(self) -> Array:
        return np.zeros(self.shape, np.float32)

    def _largest(self) -> Array:
        return np.full(self.shape, self.rng.choice([3.4e38, 65.535, 50.0, 49.0]), np.float32)

    def _nan(self) -> Array:
        return np.full(self.shape, np.nan, np.float32)

    def _inf(self) -> Array:
        return np.full(self.shape, np.inf, np.float32)

    def _negative(self) -> Array:
        return np.full(self.shape, -self.rng.uniform(0, 10), np.float32)

    def _pixel(self) -> Array:
        depth = np.full(self.shape, self.rng.choice([0.0, np.nan]), np.float32)
        depth.reshape(-1)[self.rng.integers(depth.size)] = self.rng.uniform(0.05, 50)
        return depth

    def _blocks(self) -> Array:
        size = int(self.rng.integers(1, 40))
        values = self.rng.uniform(0.1, 5, (self.shape[0] // size + 1, self.shape[1] // size + 1))
        values[self.rng.random(values.shape) < 0.2] = np.nan
        return np.kron(values, np.ones((size, size)))[: self.shape[0], : self.shape[1]]

    def _noise(self) -> Array:
        return self.rng.uniform(self.rng.choice([0.0, 0.9]), self.rng.choice([1.0, 60.0]), self.shape)

    def _wide(self) -> Array:
        with np.errstate(over="ignore"):
            return np.exp(self.rng.normal(0, 10, self.shape)).astype(np.float32)

    def _bits(self) -> Array:
        return np.frombuffer(self.rng.bytes(4 * math.prod(self.shape)), np.float32).reshape(self.shape)

    def _spikes(self) -> Array:
        depth = np.ones(self.shape, np.float32)
        depth[self.rng.random(self.shape) < 0.3] = self.rng.choice([1e30, 1e-30, 1e-42, 3e38, 1e10])
        return depth


def dressed(rng: np.random.Generator, depth: Array, scale: float) -> Array:
    """Return the image in some dtype and layout."""
    with np.errstate(all="ignore"):
        stored = depth * scale
        if scale != 1.0 or rng.random() < 0.05:
            whole = np.clip(np.nan_to_num(stored, nan=0.0, posinf=65535, neginf=0.0), 0, 65535)
            return whole.astype(rng.choice(["<u2", ">u2", "i4", "u8"]))
        image = stored.astype(rng.choice(["<f4", "<f4", "<f4", "<f4", "<f8", ">f4", "f2"]))
    if rng.random() < 0.1:
        image = np.asfortranarray(image)
    if rng.random() < 0.1:
        image = image[::-1, ::-1]
    image.flags.writeable = bool(rng.random() < 0.5) and image.flags.writeable
    return image


def extras(rng: np.random.Generator, shape: tuple[int, int]) -> dict[str, Any]:
    """Return what may come beside the depth."""
    more: dict[str, Any] = {}
    if rng.random() < 0.2:
        more["color"] = rng.integers(0, 256, (*shape, 3)).astype(np.uint8)
    if rng.random() < 0.1:
        more["mask"] = rng.random(shape) < rng.choice([0.0, 0.5, 0.99])
    if rng.random() < 0.1:
        values = rng.choice([1.0, np.nan, np.inf, 1e30, -3e38], (*shape, 2)).astype(np.float32)
        more["attributes"] = {"infrared": values[..., 0], "class": values}
    if rng.random() < 0.1:
        more["guess"] = np.eye(4)
        more["guess"][:3, 3] = rng.normal(0, 10 ** rng.uniform(-3, 6), 3)
        more["keep_guess"] = bool(rng.random() < 0.3)
    if rng.random() < 0.2:
        more["timestamp"] = rng.choice([0.0, -1.0, 1e300, float("nan")])
    return more


def fingerprint(model: nacre.Model) -> str:
    """Return the SHA-256 of everything that a model's points are."""
    digest = hashlib.sha256()
    colors = model.colors
    for values in (
        model.points,
        model.normals,
        model.confidence,
        model.last_seen,
        *model.attributes.values(),
    ):
        digest.update(values.tobytes())
    digest.update(b"" if colors is None else colors.tobytes())
    return digest.hexdigest()


def check(model: nacre.Model, report: nacre.FrameReport, before: str) -> None:
    """Hold the model and what is said of the frame against what is promised."""
    expect(report.status in STATUSES, f"status {report.status!r}")
    expect(report.index == len(model.frames) - 1, "index")
    expect(bool(report.reason) == (report.status in ("LOST", "WEAK")), f"reason {report.reason!r}")
    counts = report.depth
    removed = (
        counts.num_invalid,
        counts.num_out_of_range,
        counts.num_masked,
        counts.num_edge,
        counts.num_slanted,
    )
    total = sum(removed) + counts.num_isolated + counts.num_kept
    expect(min(removed) >= 0 and counts.num_isolated >= 0 and total == counts.num_pixels, f"counts {counts}")
    pose = report.world_from_camera
    expect(np.isfinite(pose).all(), f"pose {pose}")
    expect(np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-5), f"rotation {pose}")
    if report.status == "LOST" or (report.status == "WEAK" and report.loop_frame is None):
        expect(fingerprint(model) == before, f"a {report.status} frame changed the model")
    points, normals, confidence = model.points, model.normals, model.confidence
    expect(len(points) == len(normals) == len(confidence) == len(model) == report.num_points, "sizes")
    expect(len(points) <= model.parameters.max_points, f"{len(points)} points")
    expect(np.isfinite(points).all(), "points that are not finite")
    if len(points):
        lengths = np.linalg.norm(normals.astype(np.float64), axis=1)
        expect(np.allclose(lengths, 1.0, atol=1e-3), f"normals of length {lengths.min()} to {lengths.max()}")
        expect((confidence > 0).all() and np.isfinite(confidence).all(), "confidence")
        seen = model.last_seen
        expect(seen.min() >= 0 and seen.max() <= report.index, "last_seen")
    noise = model.noise
    expect(np.isfinite([noise.constant, noise.quadratic, noise.offset, noise.shared]).all(), f"noise {noise}")


def run_model(seed: int, trial: int, largest: int, most_frames: int, told: collections.Counter[str]) -> float:
    """Send frames through one model, and return the slowest frame's seconds."""
    rng = np.random.default_rng([seed, trial])
    camera = random_camera(rng, *random_size(rng, largest))
    scale = float(rng.choice([1.0, 1.0, 1.0, 1000.0, 5000.0]))
    changes = random_changes(rng)
    if camera.model == "orthographic" or changes.get("binning", 0) > min(camera.width, camera.height):
        changes.pop("binning", None)
    model = nacre.Model(camera, depth_scale=scale, **changes)
    scene = Scene(rng, camera)
    slowest = 0.0
    for _ in range(int(rng.integers(1, most_frames + 1))):
        kind, depth = scene.next()
        image, more = dressed(rng, depth, scale), extras(rng, scene.shape)
        before, num_frames = fingerprint(model), len(model.frames)
        start = time.process_time()
        try:
            report = model.add_frame(image, **more)
        except ValueError as error:
            expect(str(error).startswith(REFUSALS), f"{kind}: {error}")
            expect(
                fingerprint(model) == before and len(model.frames) == num_frames,
                "a refusal changed the model",
            )
            told["refused"] += 1
        else:
            try:
                check(model, report, before)
            except BrokenPromiseError as broken:
                raise BrokenPromiseError(f"{broken} ({kind}, {report}, {camera})") from None
            told[report.status] += 1
        slowest = max(slowest, time.process_time() - start)
        told["frames"] += 1
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model"
        model.save(path)
        same = fingerprint(nacre.Model.load(path)) == fingerprint(model)
        expect(same, "saving and loading changed the model")
    return slowest


def main() -> int:
    """Send frames until there were as many as wanted."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--frames", type=int, default=300, help="how many to send")
    add("--seed", type=int, default=0, help="another seed, other frames")
    add("--first", type=int, default=0, help="number of the first model, to repeat one")
    add("--largest", type=int, default=64, help="longest side of an image [pixels]")
    add("--most", type=int, default=12, help="frames of a model at most")
    add("--keep-going", action="store_true", help="count what is broken, and go on")
    options = parser.parse_args()
    faulthandler.enable()
    told: collections.Counter[str] = collections.Counter()
    slowest, trial, last_told = (0.0, 0), options.first, time.monotonic()
    while told["frames"] < options.frames:
        faulthandler.dump_traceback_later(SLOWEST, exit=True)
        try:
            slowest = max(
                slowest, (run_model(options.seed, trial, options.largest, options.most, told), trial)
            )
        except Exception as error:
            print(f"model {trial}: {type(error).__name__}: {error}", flush=True)
            told["broken"] += 1
            if not options.keep_going:
                return 1
        trial += 1
        if time.monotonic() - last_told > 30:
            last_told = time.monotonic()
            print(f"model {trial}: {dict(told)}, slowest {slowest}", file=sys.stderr, flush=True)
    faulthandler.cancel_dump_traceback_later()
    told["models"] = trial - options.first
    print(", ".join(f"{count} {name.lower()}" for name, count in sorted(told.items())), end="")
    print(f"; slowest frame {slowest[0]:.2f} s of CPU time (model {slowest[1]})")
    return int(told["broken"] > 0)


if __name__ == "__main__":
    sys.exit(main())
