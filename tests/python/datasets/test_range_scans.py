"""Range scans as depth images: resampled right, at the true place, with their gaps."""

import numpy as np
import pytest

import nacre
from nacre import Camera, FileFormatError, open_sequence
from nacre._internal.quaternions import matrix_from_quaternion


def surface(x, y):
    return 0.02 * np.sin(40 * x) * np.cos(30 * y) + 0.1 * x


def write_scan(path, *, keep=None):
    """Write a range scan of ``surface``: 0.5 mm columns, uneven rows, every other row half a column off."""
    rng = np.random.default_rng(5)
    rows, columns = 60, 80
    y = 0.05 + np.cumsum(0.0007 + rng.uniform(-1e-4, 1e-4, rows))
    x = -0.02 + 0.0005 * np.arange(columns)[None, :] + 0.00025 * (np.arange(rows)[:, None] % 2)
    y = np.broadcast_to(y[:, None], x.shape)
    valid = np.ones(x.shape, bool) if keep is None else keep(x, y)
    points = np.stack([x, y, surface(x, y)], axis=-1)[valid]
    numbers = np.full(x.shape, -1)
    numbers[valid] = np.arange(valid.sum())
    grid = "".join("0 \n" if n < 0 else f"1 {n} \n" for n in numbers.ravel())
    path.write_text(
        f"ply\nformat ascii 1.0\nobj_info num_cols {columns}\nobj_info num_rows {rows}\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element range_grid {rows * columns}\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(f"{a:.7f} {b:.7f} {c:.7f} \n" for a, b, c in points)
        + grid
    )


def points_of(frame):
    """Back-project an orthographic view."""
    v, u = np.nonzero(np.isfinite(frame.depth))
    size, width, height = frame.camera.pixel_size, frame.camera.width, frame.camera.height
    x, y = (u - (width - 1) / 2) * size, (v - (height - 1) / 2) * size
    return np.column_stack([x, y, frame.depth[v, u]]).astype(np.float64)


def test_range_scans_become_depth_images_at_the_true_place(tmp_path):
    write_scan(tmp_path / "a.ply")
    write_scan(tmp_path / "b.ply")
    q = np.array([0.1, -0.3, 0.2, 0.9])
    q /= np.linalg.norm(q)
    (tmp_path / "scans.conf").write_text(
        "camera 0 0 0 0 0 0 1\nmesh b.ply 9 9 9 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\n"
        f"bmesh b.ply 0.1 0.2 -0.3 {q[0]} {q[1]} {q[2]} {q[3]}\n"
    )
    sequence = open_sequence(tmp_path)
    assert (sequence.format, len(sequence), sequence.camera.model) == ("stanford", 2, "orthographic")
    assert sequence.camera.pixel_size == pytest.approx(0.0005, rel=1e-4)
    for frame, rotation, shift in zip(
        sequence,
        (np.eye(3), matrix_from_quaternion(q * [-1, -1, -1, 1])),
        (np.zeros(3), (0.1, 0.2, -0.3)),
        strict=True,
    ):
        assert np.isfinite(frame.depth).mean() > 0.95
        assert np.nanmin(frame.depth) > 0
        assert np.linalg.det(frame.truth[:3, :3]) == pytest.approx(1)
        in_world = points_of(frame) @ frame.truth[:3, :3].T + frame.truth[:3, 3]
        in_scan = (in_world - shift) @ rotation
        error = in_scan[:, 2] - surface(in_scan[:, 0], in_scan[:, 1])
        assert np.abs(error).max() < 1e-5


def test_a_single_range_scan_needs_no_conf(tmp_path):
    write_scan(tmp_path / "a.ply")
    sequence = open_sequence(tmp_path / "a.ply")
    assert len(sequence) == 1
    assert sequence.truth is None
    assert sequence[0].truth is None


def test_range_scan_in_millimetres(tmp_path):
    write_scan(tmp_path / "a.ply")
    one, thousand = open_sequence(tmp_path)[0], open_sequence(tmp_path, depth_scale=1000)[0]
    assert thousand.camera.pixel_size == pytest.approx(one.camera.pixel_size / 1000, rel=1e-4)
    np.testing.assert_allclose(thousand.depth, one.depth / 1000, rtol=1e-4)


def test_a_gap_in_a_range_scan_stays_a_gap(tmp_path):
    write_scan(tmp_path / "a.ply", keep=lambda x, y: np.abs(x) > 0.004)
    points = points_of(open_sequence(tmp_path / "a.ply")[0])
    view = open_sequence(tmp_path / "a.ply")
    assert not np.isfinite(view[0].depth[10:-10, 38:42]).any()
    assert len(points) > 2000


def test_a_step_in_a_range_scan_is_not_bridged(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "surface", lambda x, y: np.where(x > 0, 0.03, 0.0) + 0 * y)
    write_scan(tmp_path / "a.ply")
    depth = open_sequence(tmp_path / "a.ply")[0].depth
    near, far = np.nanmin(depth), np.nanmax(depth)
    assert far - near == pytest.approx(0.03, abs=1e-6)
    inside = depth[np.isfinite(depth)]
    assert (np.minimum(np.abs(inside - near), np.abs(inside - far)) < 1e-6).all()


def test_range_scans_follow_their_own_camera(tmp_path):
    write_scan(tmp_path / "a.ply")
    with pytest.raises(ValueError, match="camera must not be given"):
        open_sequence(tmp_path, camera=Camera(8, 6, 10, 11, 3.5, 2.5))


def test_a_broken_range_scan_is_told_at_its_view(tmp_path):
    for name in ("a", "b", "c"):
        write_scan(tmp_path / f"{name}.ply")
    (tmp_path / "b.ply").write_text((tmp_path / "b.ply").read_text()[:-5000])
    sequence = open_sequence(tmp_path)
    assert np.isfinite(sequence[2].depth).any()
    with pytest.raises(FileFormatError, match=r"b\.ply"):
        sequence[1]
    with pytest.raises(FileFormatError, match=r"b\.ply"):
        open_sequence(tmp_path / "b.ply")


@pytest.mark.parametrize(
    "line", ["bmesh a.ply 0 0 0 0 0 0", "bmesh a.ply 0 0 x 0 0 0 1", "bmesh a.ply 0 0 0 0 0 0 0"]
)
def test_a_broken_conf_names_the_line(tmp_path, line):
    write_scan(tmp_path / "a.ply")
    (tmp_path / "a.conf").write_text(f"camera 1\n{line}\n")
    with pytest.raises(FileFormatError, match=r"a\.conf") as caught:
        open_sequence(tmp_path)
    assert caught.value.line == 2


@pytest.mark.data
@pytest.mark.slow
def test_real_range_scans_lie_on_the_model(recordings):
    bunny = recordings / "stanford-bunny"
    sequence = open_sequence(bunny / "data")
    assert [sequence.file(i).stem for i in (0, 1, 9)] == ["bun000", "bun045", "top3"]
    tree = nacre.KdTree(nacre.read_points(bunny / "reconstruction" / "bun_zipper.ply").points)
    for frame in sequence:
        points = points_of(frame)[::10] @ frame.truth[:3, :3].T + frame.truth[:3, 3]
        distances, _ = tree.query(points, k=1)
        assert np.median(distances) < 0.0006


def test_the_error_names_the_scan_that_is_broken(tmp_path):
    write_scan(tmp_path / "a.ply")
    broken = (tmp_path / "a.ply").read_bytes()[:-10]
    (tmp_path / "a.ply").write_bytes(broken)
    with pytest.raises(FileFormatError) as caught:
        open_sequence(tmp_path)
    assert caught.value.path == tmp_path / "a.ply"
    assert "4800 rows of element range_grid" in caught.value.reason
