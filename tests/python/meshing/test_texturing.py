"""Meshes painted with images."""

import dataclasses
import functools

import numpy as np
import pytest
from painted_sheet import CAMERA, SIDE, TRIANGLES, VERTICES, VIEWS, look, lookup, paint, pose_at

import nacre
from nacre.meshing import Texture, texture_atlas, texture_mesh, texture_painting, texture_views


def painted(texture, weights=(1 / 3, 1 / 3, 1 / 3)):
    """Return the colour of each triangle at a place between its corners."""
    return lookup(texture, np.einsum("c,tck->tk", weights, texture.uv[texture.triangles].astype(float)))


def steps_at_seams(texture):
    """Return how far the colours of one vertex differ between the patches that it belongs to."""
    pairs = np.unique(np.column_stack([TRIANGLES.ravel(), texture.triangles.ravel()]), axis=0)
    same = np.flatnonzero(pairs[1:, 0] == pairs[:-1, 0])
    colors = lookup(texture, texture.uv[pairs[:, 1]].astype(float))
    return np.abs(colors[same + 1] - colors[same])


def is_in_images():
    return (np.abs(VERTICES[TRIANGLES][..., :2]) < 0.195).all(axis=(1, 2))


def test_places_of_the_surface_have_the_colours_of_its_paint():
    texture = texture_mesh(VERTICES, TRIANGLES, VIEWS)
    for weights in ((1 / 3, 1 / 3, 1 / 3), (0.7, 0.2, 0.1), (0.1, 0.1, 0.8)):
        places = np.einsum("c,tck->tk", weights, VERTICES[TRIANGLES])
        errors = np.abs(painted(texture, weights) - paint(places))[is_in_images()]
        assert np.median(errors) < 1.5
        assert np.quantile(errors, 0.99) < 5
    assert texture.image.dtype == np.uint8
    assert 0 <= texture.uv.min() < texture.uv.max() <= 1


def test_an_image_of_the_whole_paints_it_nearly_alone():
    """The middle camera shows all at least half as well as the others: there are few seams."""
    texture = texture_mesh(VERTICES, TRIANGLES, VIEWS)
    rows = texture.triangles[is_in_images()]
    assert len(np.unique(rows)) < 1.05 * len(np.unique(TRIANGLES[is_in_images()]))


@pytest.mark.parametrize("change", ["of whole images", "across each image"])
def test_exposures_meet_without_a_step(change):
    across = np.linspace(1.0, 1.3, CAMERA.width) * np.ones((CAMERA.height, 1))
    exposures = {"of whole images": (1.0, 1.3), "across each image": (across, across)}[change]
    flat = functools.partial(look, paint=lambda points: np.full(points.shape, 120.0))
    views = [flat(pose_at(x), exposure) for x, exposure in zip((-0.22, 0.22), exposures, strict=True)]
    texture = texture_mesh(VERTICES, TRIANGLES, views)
    steps = steps_at_seams(texture)
    assert len(steps) > SIDE / 2
    assert steps.max() < 3
    if change == "of whole images":
        assert np.abs(painted(texture)[is_in_images()] - 120 * np.sqrt(1.3)).max() < 2


def colors_along_seams(texture):
    """Return the colours of both sides at seven places of each edge where patches meet."""
    sides = [(0, 1), (1, 2), (2, 0)]
    ends = np.concatenate([TRIANGLES[:, side] for side in sides])
    nodes = np.concatenate([texture.triangles[:, side] for side in sides])
    flipped = ends[:, 0] > ends[:, 1]
    ends[flipped], nodes[flipped] = ends[flipped][:, ::-1], nodes[flipped][:, ::-1]
    order = np.lexsort(ends.T)
    ends, nodes = ends[order], nodes[order]
    twins = np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    twins = twins[(nodes[twins] != nodes[twins + 1]).all(axis=1)]
    uv = texture.uv[nodes].astype(float)
    places = [(1 - part) * uv[:, 0] + part * uv[:, 1] for part in np.linspace(0.05, 0.95, 7)]
    return [np.stack([lookup(texture, place[rows]) for place in places]) for rows in (twins, twins + 1)]


def test_images_beside_their_places_fade_into_each_other():
    """Both show the same stripes, one of them 4 mm, a pixel, beside its place: so a text would break."""

    def stripes(points, shift=0.0):
        return 128 + 90 * np.sin(300 * (points[:, [0]] - points[:, [1]] - shift)) * np.ones(3)

    views = [
        look(pose_at(x), paint=functools.partial(stripes, shift=shift))
        for x, shift in ((-0.22, 0.0), (0.22, 0.004))
    ]
    left, right = colors_along_seams(texture_mesh(VERTICES, TRIANGLES, views))
    assert left.shape[1] > SIDE / 2
    assert left.std() > 20  # the stripes are still there
    assert np.abs(left - right).mean() < 10  # 47 where they are cut


def test_corners_that_lack_light_are_as_bright_as_the_middle():
    v, u = np.indices((CAMERA.height, CAMERA.width))
    squared = ((u - CAMERA.cx) / CAMERA.fx) ** 2 + ((v - CAMERA.cy) / CAMERA.fy) ** 2
    light = (1 + 1.2 * squared) ** -2  # 0.55 at the corners
    poses = [pose_at(x, y) for x in (-0.15, -0.05, 0.05, 0.15) for y in (-0.12, 0.0, 0.12)]
    views = [
        look(pose, exposure) for pose, exposure in zip(poses, 6 * [0.9 * light, 1.1 * light], strict=True)
    ]
    places = VERTICES[TRIANGLES].mean(axis=1)
    ratios = (painted(texture_mesh(VERTICES, TRIANGLES, views)) / paint(places))[is_in_images()]
    assert np.ptp(np.quantile(ratios, (0.02, 0.98))) < 0.08  # 0.34 as the images are


RED = np.array([250.0, 0.0, 0.0])


def test_what_hides_a_surface_does_not_paint_it():
    """A red plate stands before the sheet, and behind it the other images show the sheet."""
    plate = np.array([[-0.04, -0.05, 0.4], [0.04, -0.05, 0.4], [-0.04, 0.05, 0.4], [0.04, 0.05, 0.4]])
    scene = (
        np.concatenate([VERTICES, plate]),
        np.concatenate([TRIANGLES, len(VERTICES) + np.array([[0, 2, 1], [1, 2, 3]])]),
    )

    def color(points):
        return np.where(points[:, 2:] < 0.5, RED, paint(points))

    views = [look(pose_at(x), paint=color, mesh=scene) for x in (-0.2, 0.0, 0.2)]
    colors = np.clip(color(scene[0]), 0, 255).astype(np.uint8)
    texture = texture_mesh(*scene, views, colors=colors)
    shown = np.abs(painted(texture) - color(scene[0][scene[1]].mean(axis=1))).max(axis=1)
    assert np.quantile(shown[:-2][is_in_images()], 0.99) < 12
    assert shown[-2:].max() < 3
    # Where the mesh lacks the plate, its depth tells.
    texture = texture_mesh(VERTICES, TRIANGLES, views, colors=colors[: len(VERTICES)])
    shown = np.abs(painted(texture) - paint(VERTICES[TRIANGLES].mean(axis=1))).max(axis=1)
    assert np.quantile(shown[is_in_images()], 0.99) < 12


class TestWithoutAnImage:
    COLORS = (200 - 0.6 * paint(VERTICES)).astype(np.uint8)

    def test_triangles_have_the_colours_of_their_vertices(self):
        away = [look(pose_at(0.45))]  # shows what is beyond x = 0.13
        texture = texture_mesh(VERTICES, TRIANGLES, away, colors=self.COLORS)
        left = (VERTICES[TRIANGLES][..., 0] < -0.1).all(axis=1)
        for weights in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.25, 0.25)):
            expected = np.einsum("c,tck->tk", weights, self.COLORS[TRIANGLES].astype(float))
            assert np.abs(painted(texture, weights) - expected)[left].max() < 1.5

    def test_a_guess_has_them_too(self):
        is_seen = VERTICES[:, 0] > 0
        texture = texture_mesh(VERTICES, TRIANGLES, VIEWS, colors=self.COLORS, is_seen=is_seen)
        guess = (VERTICES[TRIANGLES][..., 0] < -0.15).all(axis=1)
        expected = self.COLORS[TRIANGLES].mean(axis=1)
        assert np.abs(painted(texture) - expected)[guess].max() < 1.5

    def test_reverse_sides_are_not_painted(self):
        vertices, colors = np.concatenate([VERTICES] * 2), np.concatenate([self.COLORS] * 2)
        triangles = np.concatenate([TRIANGLES, SIDE**2 + TRIANGLES[:, ::-1]])
        texture = texture_mesh(vertices, triangles, VIEWS, colors=colors)
        front, back = np.split(painted(texture), 2)
        assert np.median(np.abs(front - paint(VERTICES[TRIANGLES].mean(axis=1)))[is_in_images()]) < 1.5
        assert np.abs(back - self.COLORS[TRIANGLES].mean(axis=1)).max() < 1.5


def test_an_atlas_that_is_too_large_is_scaled_down(monkeypatch):
    whole = texture_mesh(VERTICES, TRIANGLES, VIEWS)
    for module in (texture_atlas, texture_painting):
        monkeypatch.setattr(module, "MOST_PIXELS", 96)
    small = texture_mesh(VERTICES, TRIANGLES, VIEWS)
    assert max(small.image.shape) <= 96 < max(whole.image.shape)
    assert np.quantile(np.abs(painted(small) - painted(whole))[is_in_images()], 0.95) < 20
    monkeypatch.setattr(texture_painting, "MOST_PIXELS", 12)
    monkeypatch.setattr(texture_atlas, "MOST_PIXELS", 12)
    colors = np.zeros((SIDE**2, 3), np.uint8)
    with pytest.raises(ValueError, match="triangles without a view must fit one atlas, got"):
        texture_mesh(VERTICES, TRIANGLES, VIEWS[:1], colors=colors, is_seen=VERTICES[:, 0] > 0)


def test_cameras_of_other_kinds():
    """A radial depth and parallel rays."""
    cameras = (
        dataclasses.replace(VIEWS[1], camera=nacre.Camera(160, 120, 150, 150, 79.5, 59.5, depth="radial")),
        dataclasses.replace(VIEWS[1], camera=nacre.Camera.orthographic(160, 120, 0.003)),
    )
    for view in cameras:
        texture = texture_mesh(VERTICES, TRIANGLES, [dataclasses.replace(view, depth=None)])
        assert texture.image.std() > 20


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"views": []}, "views must have at least one view, got none"),
        ({"views": VIEWS[0]}, "views must be a sequence of TextureView, got TextureView"),
        ({"views": [VIEWS[0], 3]}, r"views\[1\] must be a TextureView, got int"),
        ({"colors": np.zeros((3, 3), np.uint8)}, r"colors must be \(2025, 3\) uint8, got \(3, 3\)"),
        ({"colors": np.zeros((SIDE**2, 3))}, "colors must be .* uint8, got .* of float64"),
        ({"is_seen": [True]}, r"is_seen must have one entry per vertex \(2025\)"),
        ({"triangles": [[0, 1, SIDE**2]]}, "triangles must hold indices of the 2025 vertices, got 2025"),
        ({"vertices": np.full((SIDE**2, 3), np.nan)}, "vertices"),
        ({"views": [dataclasses.replace(VIEWS[0], world_from_camera=pose_at(50))]}, "views show no triangle"),
    ],
)
def test_misuse(change, message):
    arguments = {"vertices": VERTICES, "triangles": TRIANGLES, "views": VIEWS} | change
    with pytest.raises((ValueError, TypeError), match=message):
        texture_mesh(**arguments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"color": np.zeros((120, 160), np.uint8)}, r"views\[0\].color must be \(120, 160, 3\) uint8"),
        ({"color": np.zeros((120, 160, 3))}, r"views\[0\].color must be .* got .* of float64"),
        ({"depth": np.zeros((4, 4))}, r"views\[0\].depth must have shape \(120, 160\), got \(4, 4\)"),
        ({"world_from_camera": np.full((4, 4), np.nan)}, r"views\[0\].world_from_camera must be a rigid"),
        ({"camera": None}, r"views\[0\].camera must be a nacre.Camera, got NoneType"),
    ],
)
def test_views_that_do_not_fit(change, message):
    with pytest.raises((ValueError, TypeError), match=message):
        texture_mesh(VERTICES, TRIANGLES, [dataclasses.replace(VIEWS[0], **change)])


class TestTextureViews:
    @pytest.fixture
    def recording(self, tmp_path):
        """Return views along a path; of those that share a place the second is sharp."""
        noise = np.random.default_rng(0).integers(0, 256, (120, 160, 3)).astype(np.uint8)
        blurred = np.full_like(noise, 128)
        colors = [blurred, noise] * 6
        poses = [pose_at(0.1 * (i // 2)) for i in range(12)]
        nacre.write_recording(
            tmp_path / "r", CAMERA, [VIEWS[0].depth] * 12, depth_scale=1000, colors=colors, poses=poses
        )
        return nacre.open_sequence(tmp_path / "r"), np.array(poses)

    def test_sharp_ones_along_the_path(self, recording):
        sequence, poses = recording
        views = texture_views(sequence, poses, most=6)
        assert 4 <= len(views) <= 6
        assert all(view.color.std() > 50 for view in views)
        places = [view.world_from_camera[0, 3] for view in views]
        assert places == sorted(set(places))
        assert len(texture_views(sequence, poses)) == 12

    def test_views_without_a_pose_or_an_image_are_left_out(self, recording):
        sequence, poses = recording
        poses[1:] = np.nan
        assert len(texture_views(sequence, poses)) == 1
        with pytest.raises(nacre.FileFormatError, match="no view has both a pose and a colour image"):
            texture_views(sequence, np.full_like(poses, np.nan))
        with pytest.raises(nacre.FileFormatError, match="no view has both a pose and a colour image"):
            texture_views(sequence.without_color(), poses)

    def test_an_image_that_cannot_be_read_is_left_out(self, recording, caplog):
        sequence, poses = recording
        sequence.color_file(4).write_bytes(b"damaged")
        assert len(texture_views(sequence, poses)) == 11
        assert "not an image" in caplog.text

    def test_misuse(self, recording):
        sequence, poses = recording
        with pytest.raises(ValueError, match=r"poses must have one matrix per view \(12\), got 2"):
            texture_views(sequence, poses[:2])
        with pytest.raises(ValueError, match="most must be an integer of at least 1, got 0"):
            texture_views(sequence, poses, most=0)


def test_a_texture_says_what_it_holds():
    texture = Texture(np.zeros((2, 3, 3), np.uint8), np.zeros((4, 2), np.float32), np.zeros((1, 3), np.int32))
    assert repr(texture) == "Texture(image=uint8[2, 3, 3], uv=float32[4, 2], triangles=int32[1, 3])"
