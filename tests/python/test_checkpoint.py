"""Saved models: what is loaded goes on to the same bits, whatever the model was in the middle of."""

import contextlib
import dataclasses
import functools
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_files.seals import sealed_model
from test_determinism import digest

import nacre
from nacre._internal.checkpoint import POINTS_AND_MESHES
from nacre.io import meshes, points

Frames = list[dict[str, Any]]
MESH = nacre.built_in_object()
CAMERA = nacre.default_camera(MESH)


@functools.cache
def view(degrees: float) -> Any:
    pose = nacre.turntable_poses(MESH, 2, np.radians(degrees))[1]
    return MESH.simulate_depth(CAMERA, pose, noise=0.0005, edge_mixing=1.0, seed=int(degrees))


def frame(degrees: float, **more: Any) -> dict[str, Any]:
    return {"depth": view(degrees), "timestamp": degrees / 100, **more}


def colored(degrees: float) -> dict[str, Any]:
    random = np.random.default_rng(int(degrees))
    color = random.integers(0, 256, (*view(degrees).shape, 3), dtype=np.uint8)
    heat = np.where(random.random(view(degrees).shape) < 0.1, np.nan, 20 * view(degrees))
    return frame(degrees, color=color, attributes={"heat": heat, "classes": color[..., :2] / 255})


def turning() -> Frames:
    return [frame(15 * i) for i in range(6)]


def lost_and_found() -> Frames:
    """Nothing is seen; then the other side, from where the place is followed; then back."""
    nothing = np.full_like(view(0), np.nan)
    return [frame(0), {"depth": nothing}, frame(180), frame(185), frame(60), {"depth": nothing}, frame(8)]


def in_colour() -> Frames:
    return [colored(0), frame(15), colored(30), colored(45)]


def room() -> tuple[nacre.Camera, Frames, dict[str, Any]]:
    """Return the last part of a turn in a room, whose focal length is wrong: loops close."""
    import test_loop_closure as loops

    mesh = loops.furnished_room()
    depth = [
        mesh.simulate_depth(loops.camera(), loops.pose(3 * k), noise="kinect", seed=k) for k in range(26)
    ]
    return loops.camera(0.02), [{"depth": image} for image in depth], {}


def on_a_table() -> tuple[nacre.Camera, Frames, dict[str, Any]]:
    import test_region as regions

    frames = [{"depth": regions.scene(degrees)} for degrees in (0, 180, 60, 75)]
    return regions.CAMERA, frames, {"region": nacre.RegionParameters(object=True)}


SCENES: dict[str, Any] = {
    "turning": lambda: (CAMERA, turning(), {}),
    "lost": lambda: (CAMERA, lost_and_found(), {}),
    "colour": lambda: (CAMERA, in_colour(), {}),
    "full": lambda: (CAMERA, turning(), {"max_points": 3000}),
    "paper": lambda: (CAMERA, turning()[:4], {"preset": "paper"}),
    "wlop+": lambda: (CAMERA, turning()[:4], {"fusion_method": "wlop+"}),
    "room": room,
    "object": on_a_table,
}


def bits(model: nacre.Model) -> str:
    """Return a digest of all that can be seen of a model but times."""
    reports = [dataclasses.replace(report, milliseconds={}) for report in model.frames]
    arrays = [array for report in reports for array in (report.information, report.weak_directions)]
    attributes = [model.attributes[name] for name in model.attributes]
    return digest(
        model.points, model.normals, [] if model.colors is None else model.colors, *attributes,
        model.confidence, model.last_seen, model.poses, *arrays,
        np.array([*map(repr, map(dataclasses.astuple, reports))]),
        dataclasses.astuple(model.noise), [model.spacing],
    )  # fmt: skip


def through_a_file(model: nacre.Model, folder: Path) -> nacre.Model:
    model.save(folder / "model.ckpt")
    return nacre.Model.load(folder / "model.ckpt")


def test_every_format_of_points_and_meshes_is_known_to_checkpoints() -> None:
    assert {*points.SUFFIXES, *meshes.READ_SUFFIXES, *meshes.WRITE_SUFFIXES} == POINTS_AND_MESHES


@pytest.mark.parametrize("name", ["model.ply", "MODEL.PCD", "model.obj", "model.glb"])
def test_a_model_is_not_saved_under_the_name_of_points_or_a_mesh(name: str, tmp_path: Path) -> None:
    model = nacre.Model(nacre.Camera(8, 6, 8, 8, 3.5, 2.5))
    with pytest.raises(ValueError, match=r"path must not end in \.\w+, got .*nacre\.write_points\(path,"):
        model.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", SCENES)
def test_a_model_that_is_saved_and_loaded_after_every_frame_is_the_same(name: str, tmp_path: Path) -> None:
    camera, frames, options = SCENES[name]()
    undisturbed = nacre.Model(camera, **options)
    other = through_a_file(nacre.Model(camera, **options), tmp_path)
    for given in frames:
        undisturbed.add_frame(**given)
        other.add_frame(**given)
        assert bits(other) == bits(undisturbed)
        other = through_a_file(other, tmp_path)
        assert bits(other) == bits(undisturbed)
    statuses = {report.status for report in undisturbed.frames}
    assert "TRACKED" in statuses
    assert ("LOST" in statuses) == (name in ("lost", "object"))
    if name == "room":
        assert any(report.loop_frame is not None for report in undisturbed.frames)


def test_it_goes_on_from_any_frame_for_any_number_of_threads(tmp_path: Path) -> None:
    frames = turning()
    model = nacre.Model(CAMERA)
    for k, given in enumerate(frames):
        model.save(tmp_path / f"{k}")
        model.add_frame(**given)
    for k in range(len(frames)):
        other = nacre.Model.load(tmp_path / f"{k}")
        for given in frames[k:]:
            other.add_frame(**given)
        assert bits(other) == bits(model)


@pytest.mark.parametrize("noise", [None, 0.001, nacre.NoiseModel(0.001, 0.002, 0.4, 0.5), "kinect", "tof"])
def test_a_noise_that_was_given_stays_given(noise: Any, tmp_path: Path) -> None:
    model = nacre.Model(CAMERA, depth={"noise": noise})
    other = through_a_file(model, tmp_path)
    assert other.parameters == model.parameters
    for given in turning()[:2]:
        model.add_frame(**given)
        other.add_frame(**given)
    assert bits(other) == bits(model)


def test_what_was_given_stays_given(tmp_path: Path) -> None:
    camera = nacre.Camera(96, 72, 90.0, 91.0, 47.5, 35.5, distortion=(0.1, -0.05, 0.001, 0, 0.01))
    model = nacre.Model(camera, depth_scale=1000, spacing=0.004)
    depth = np.full((72, 96), 800, np.uint16)
    for _ in range(2):
        model = through_a_file(model, tmp_path)
        assert model.camera == camera
        assert model.parameters == nacre.Model(camera, spacing=0.004).parameters
        model.add_frame(depth)
    assert model.frames[1].status in ("TRACKED", "WEAK")


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    model = nacre.Model(CAMERA, spacing=0.004)
    for given in lost_and_found()[:4]:
        model.add_frame(**given)
    path = tmp_path_factory.mktemp("saved") / "model"
    model.save(path)
    return path.read_bytes()


def refused(data: bytes, path: Path) -> nacre.FileFormatError:
    path.write_bytes(data)
    with pytest.raises(nacre.FileFormatError) as caught:
        nacre.Model.load(path)
    assert str(path) in str(caught.value)
    assert caught.value.offset is not None
    return caught.value


def test_a_file_that_is_cut_short_says_so(saved: bytes, tmp_path: Path) -> None:
    for length in [*range(0, 60, 7), len(saved) // 2, len(saved) - 1]:
        error = refused(saved[:length], tmp_path / "cut")
        assert "no model" in error.reason or f"{length} of its {len(saved)} bytes" in error.reason


def test_a_file_that_goes_on_after_its_end_is_refused(saved: bytes, tmp_path: Path) -> None:
    error = refused(saved + b"x", tmp_path / "longer")
    assert f"{len(saved) + 1} bytes and says that they are {len(saved)}" in error.reason
    assert error.offset == len(saved)


def test_a_bit_that_flipped_is_found(saved: bytes, tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    for place in [*range(48), *random.integers(48, len(saved), 30)]:
        if 12 <= place < 32:  # the name of the version, for the reader
            continue
        damaged = bytearray(saved)
        damaged[place] ^= 1 << int(random.integers(8))
        refused(bytes(damaged), tmp_path / "flipped")


def test_another_format_says_who_wrote_it(saved: bytes, tmp_path: Path) -> None:
    error = refused(saved[:8] + struct.pack("<I", 99) + saved[12:], tmp_path / "newer")
    assert "checkpoint format 99" in error.reason
    assert nacre.__version__ in error.reason


def test_whoever_forges_the_checksum_breaks_nothing(tmp_path: Path) -> None:
    """Each byte of a small model takes other values: it is refused, or it is a model that goes on."""
    camera = nacre.Camera(24, 20, 30.0, 30.0, 11.5, 9.5)
    model = nacre.Model(camera, spacing=0.05)
    v, u = np.indices((20, 24))
    depth = 1 + 0.02 * np.sin(u / 3) + 0.02 * np.cos(v / 2)
    for i in range(3):
        model.add_frame(depth + 0.001 * i)
    model.save(tmp_path / "small")
    data = (tmp_path / "small").read_bytes()
    assert sealed_model(data) == data
    random = np.random.default_rng(1)
    path, num_loaded = tmp_path / "forged", 0
    for _ in range(80):
        forged = bytearray(data)
        place = int(random.integers(48, len(data)))
        forged[place : place + 8] = random.choice(
            [b"\xff" * 8, b"\0" * 8, random.bytes(8), b"\0\0\0\0\0\0\xf0\x7f"]
        )
        path.write_bytes(sealed_model(bytes(forged)))
        try:
            other = nacre.Model.load(path)
        except nacre.FileFormatError:
            continue
        num_loaded += 1
        with contextlib.suppress(ValueError):
            other.add_frame(np.full(depth.shape, 1.0) if other.camera == camera else np.ones((1, 1)))
    assert 0 < num_loaded < 80


def test_finite_but_absurd_values_are_refused(tmp_path: Path) -> None:
    frames = lost_and_found()[:4]
    model = nacre.Model(CAMERA, spacing=0.004)
    for given in frames:
        model.add_frame(**given)
    model.save(tmp_path / "model")
    data = (tmp_path / "model").read_bytes()
    pose = model.frames[1].world_from_camera
    sheared, far = pose.copy(), pose.copy()
    sheared[0, 1] += 0.1
    far[0, 3] = 2e30
    first, normal = model.points[0], model.normals[0]
    forgeries = {
        "points": (model.points.tobytes(), np.float32([3e38, *first[1:]]).tobytes()),
        "normals": (model.normals.tobytes(), (2 * normal).tobytes()),
        "confidence": (model.confidence.tobytes(), np.float32(-1).tobytes()),
        "spacing": (struct.pack("<d", model.spacing), struct.pack("<d", 1e-30)),
        "a large spacing": (struct.pack("<d", model.spacing), struct.pack("<d", 1e35)),
        "a pose": (pose.T.tobytes(), sheared.T.tobytes()),
        "a far pose": (pose.T.tobytes(), far.T.tobytes()),
    }
    for name, (known, absurd) in forgeries.items():
        place = data.rfind(known)
        assert place > 0, name
        error = refused(
            sealed_model(data[:place] + absurd + data[place + len(absurd) :]), tmp_path / "forged"
        )
        assert re.search("no surface|spacing is not|a pose is not", error.reason), (name, error)


def whole(*numbers: int) -> bytes:
    """Return whole numbers as they are written: folded, 7 bits a byte, the lowest first."""
    written = bytearray()
    for number in numbers:
        bits = 2 * number if number >= 0 else -2 * number - 1
        while bits >= 0x80:
            written.append(bits & 0x7F | 0x80)
            bits >>= 7
        written.append(bits)
    return bytes(written)


def test_reports_that_cannot_be_are_refused(tmp_path: Path) -> None:
    """Poses that are no motions, more pixels than the frame has, more points than the model may have."""
    model = nacre.Model(CAMERA, max_points=3000)
    for given in turning()[:3]:
        model.add_frame(**given)
    model.save(tmp_path / "model")
    data = (tmp_path / "model").read_bytes()
    middle = model.frames[1]
    pose = middle.world_from_camera[:3]
    sheared, far = pose.copy(), pose.copy()
    sheared[0, 1] += 0.1
    far[0, 3] = 2e30
    none, spacing = b"\0", struct.pack("<d", middle.spacing)  # no reason
    depth, num_inside = dataclasses.astuple(middle.depth), middle.region.num_inside
    fused = (middle.num_updated, middle.num_inserted, middle.num_removed, middle.num_points)
    shown = none + whole(middle.num_inliers)
    forgeries = {
        "a sheared pose": (pose.T.tobytes(), sheared.T.tobytes()),
        "a far pose": (pose.T.tobytes(), far.T.tobytes()),
        "more inliers than points": (shown, none + whole(num_inside + 1)),
        "fewer inliers than none": (shown, none + b"\x81\0"),
        "pixels of another camera": (whole(*depth), whole(depth[0] + 1, depth[1] + 1, *depth[2:])),
        "a pixel counted twice": (whole(*depth), whole(depth[0], depth[1] + 1, *depth[2:])),
        "a pixel not counted": (whole(*depth), whole(depth[0], depth[1] - 1, *depth[2:])),
        "more inside than there is": (whole(*depth, num_inside), whole(*depth, num_inside + 1)),
        "more updated than there were": (whole(*fused), whole(3001, *fused[1:])),
        "more inserted than were seen": (whole(*fused), whole(fused[0], num_inside + 1, *fused[2:])),
        "more removed than there were": (whole(*fused), whole(*fused[:2], 3001 + fused[1], 63)),
        "more points than are allowed": (whole(fused[3]) + spacing, whole(3001) + spacing),
        "fewer points than the model": (whole(len(model)) + spacing, whole(len(model) - 1) + spacing),
    }
    for name, (known, absurd) in forgeries.items():
        assert data.count(known) == 1, name
        assert len(absurd) == len(known), name
        error = refused(sealed_model(data.replace(known, absurd)), tmp_path / "forged")
        assert "report" in error.reason, (name, error)
