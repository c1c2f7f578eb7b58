"""Trajectories: formats, rotations, times."""

import hypothesis.extra.numpy as hnp
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given

from nacre import FileFormatError, Trajectory, associate, read_trajectory, write_trajectory
from nacre._internal.quaternions import matrix_from_quaternion, quaternion_from_matrix


def random_poses(count, seed=0):
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = matrix_from_quaternion(rng.normal(size=(count, 4)))
    poses[:, :3, 3] = rng.normal(size=(count, 3))
    return poses


quaternions = hnp.arrays(np.float64, 4, elements=st.floats(-1, 1))


@given(quaternions)
def test_quaternion_gives_a_rotation_and_comes_back(q):
    assume(np.linalg.norm(q) > 1e-3)
    rotation = matrix_from_quaternion(q)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1)
    again = quaternion_from_matrix(rotation)
    assert again[3] >= 0
    unit = q / np.linalg.norm(q)
    assert min(np.abs(again - unit).max(), np.abs(again + unit).max()) < 1e-12


def test_quaternion_order_is_x_y_z_w():
    half = np.sqrt(0.5)
    turn_about_z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    np.testing.assert_allclose(matrix_from_quaternion([0, 0, half, half]), turn_about_z, atol=1e-15)
    np.testing.assert_allclose(quaternion_from_matrix(turn_about_z), [0, 0, half, half], atol=1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns(axis):
    rotation = -np.eye(3)
    rotation[axis, axis] = 1
    np.testing.assert_allclose(matrix_from_quaternion(quaternion_from_matrix(rotation)), rotation, atol=1e-15)


def test_quaternions_of_any_length_and_sign_mean_the_same_rotation():
    q = np.array([0.1, -0.2, 0.3, 0.4])
    for factor in (1e-200, -1, 1e150):
        np.testing.assert_allclose(matrix_from_quaternion(q * factor), matrix_from_quaternion(q), atol=1e-15)


@pytest.mark.parametrize(
    "bad", [[0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1], [1, 2, 3], [[[1, 0, 0, 0]]]]
)
def test_illegal_quaternions(bad):
    with pytest.raises(ValueError, match="quaternions must"):
        matrix_from_quaternion(bad)


def test_illegal_rotations():
    with pytest.raises(ValueError, match="rotations must"):
        quaternion_from_matrix(np.eye(4))


def test_tum_comes_back_with_all_digits(tmp_path):
    poses = random_poses(50)
    times = 1305031102.175304 + np.sort(np.random.default_rng(3).random(50))
    write_trajectory(tmp_path / "t.txt", times, poses)
    again = read_trajectory(tmp_path / "t.txt")
    np.testing.assert_array_equal(again.timestamps, times)
    np.testing.assert_array_equal(again.poses[:, :3, 3], poses[:, :3, 3])
    np.testing.assert_allclose(again.poses, poses, atol=1e-15)


def test_whole_numbers_stay_short(tmp_path):
    write_trajectory(tmp_path / "t.txt", [0, 12], np.tile(np.eye(4), (2, 1, 1)))
    lines = (tmp_path / "t.txt").read_text().splitlines()
    assert lines[1:] == ["0 0 0 0 0 0 0 1", "12 0 0 0 0 0 0 1"]


def test_tum_with_comments_and_unnormalised_quaternion(tmp_path):
    (tmp_path / "t.txt").write_text(
        "# ground truth\n\n1.5 1 2 3 0 0 2 2  # quarter turn\n2.5 0 0 0 0 0 0 -1\n"
    )
    found = read_trajectory(tmp_path / "t.txt")
    np.testing.assert_array_equal(found.timestamps, [1.5, 2.5])
    np.testing.assert_allclose(
        found.poses[0], [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], atol=1e-15
    )
    np.testing.assert_allclose(found.poses[1], np.eye(4), atol=1e-15)


def test_redwood_log(tmp_path):
    poses = random_poses(3)
    blocks = []
    for i, pose in zip((0, 2, 5), poses, strict=True):
        blocks.append(
            f"{i} {i} {i + 1}\n" + "".join(" ".join(f"{x:.8f}" for x in row) + "\n" for row in pose)
        )
    (tmp_path / "t.log").write_text("".join(blocks))
    found = read_trajectory(tmp_path / "t.log")
    np.testing.assert_array_equal(found.timestamps, [0, 2, 5])
    np.testing.assert_allclose(found.poses, poses, atol=1e-7)
    rotations = found.poses[:, :3, :3]
    np.testing.assert_allclose(
        rotations @ rotations.transpose(0, 2, 1), np.tile(np.eye(3), (3, 1, 1)), atol=1e-14
    )


def test_seven_scenes_pose(tmp_path):
    pose = random_poses(1)[0]
    (tmp_path / "p.txt").write_text("".join("\t ".join(f"{x: .7e}" for x in row) + "\t \n" for row in pose))
    found = read_trajectory(tmp_path / "p.txt")
    assert len(found) == 1
    np.testing.assert_allclose(found.poses[0], pose, atol=1e-6)


@pytest.mark.parametrize(
    ("times", "poses"),
    [
        ([0, 1], np.eye(4)[None]),
        ([[0]], np.eye(4)[None]),
        ([np.nan], np.eye(4)[None]),
        ([0], np.eye(3)[None]),
    ],
)
def test_trajectory_shapes_are_checked(tmp_path, times, poses):
    with pytest.raises(ValueError, match=r"timestamps|poses"):
        write_trajectory(tmp_path / "t.txt", times, poses)
    assert list(tmp_path.iterdir()) == []


def test_a_trajectory_is_written_as_it_is(tmp_path):
    trajectory = Trajectory([0.0, 2.5], np.stack([np.eye(4)] * 2))
    write_trajectory(tmp_path / "t.txt", trajectory)
    assert read_trajectory(tmp_path / "t.txt") == trajectory
    with pytest.raises(ValueError, match="poses must not be given with a Trajectory"):
        write_trajectory(tmp_path / "t.txt", trajectory, trajectory.poses)
    with pytest.raises(TypeError, match="poses must be"):
        write_trajectory(tmp_path / "t.txt", [0.0, 2.5])
    assert read_trajectory(tmp_path / "t.txt") == trajectory


def test_poses_that_are_not_finite_are_not_written(tmp_path):
    with pytest.raises(ValueError, match="finite"):
        write_trajectory(tmp_path / "t.txt", [0], np.full((1, 4, 4), np.nan))
    far = np.eye(4)[None].copy()
    far[0, 2, 3] = 1e31
    with pytest.raises(ValueError, match=r"at most 1e\+30 m away, got 1e\+31"):
        write_trajectory(tmp_path / "t.txt", [0], far)


def test_a_trajectory_owns_its_arrays():
    poses = random_poses(2)
    trajectory = Trajectory(np.arange(2.0), poses)
    poses[:] = 0
    assert trajectory.poses[0, 3, 3] == 1
    with pytest.raises(ValueError, match="read-only"):
        trajectory.poses[0] = 0


def turning(times):
    """Return a steady turn about z and a steady motion along x."""
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    for pose, t in zip(poses, times, strict=True):
        pose[:2, :2] = [[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]
        pose[0, 3] = 3 * t
    return poses


def test_poses_between_times_are_interpolated():
    times = np.arange(0, 1, 0.01)
    trajectory = Trajectory(times[::-1], turning(times)[::-1])
    wanted = np.array([0.1234, 0.5, 0.5001, 0.98999])
    np.testing.assert_allclose(trajectory.at(wanted), turning(wanted), atol=1e-12)


@given(st.floats(0, 1), st.floats(1e-12, 3.0))
def test_interpolation_is_exact_for_small_and_large_turns(fraction, angle):
    trajectory = Trajectory(np.array([0.0, 1.0]), turning([0.0, angle]))
    found = trajectory.at([fraction], max_difference=1)[0]
    np.testing.assert_allclose(found, turning([fraction * angle])[0], atol=1e-12)


def test_poses_across_a_gap_are_the_nearest_or_none():
    times = np.array([0.0, 0.01, 1.0])
    trajectory = Trajectory(times, turning(times))
    found = trajectory.at([-0.03, -0.015, 0.02, 0.5, 0.985, 1.019, 1.03])
    np.testing.assert_array_equal(
        np.isnan(found).all(axis=(1, 2)), [True, False, False, True, False, False, True]
    )
    np.testing.assert_array_equal(found[[1, 2, 4, 5]], turning(times)[[0, 1, 2, 2]])
    np.testing.assert_array_equal(trajectory.at(times), turning(times))


def test_an_empty_trajectory_has_no_poses():
    assert np.isnan(Trajectory(np.zeros(0), np.zeros((0, 4, 4))).at([0.0])).all()


def associate_by_force(a, b, limit):
    """Take the nearest pair, strike both out, and again."""
    pairs, free_a, free_b = [], set(range(len(a))), set(range(len(b)))
    while True:
        left = [(abs(a[i] - b[j]), i, j) for i in free_a for j in free_b if abs(a[i] - b[j]) <= limit]
        if not left:
            return sorted(pairs)
        _, i, j = min(left)
        pairs.append((i, j))
        free_a.remove(i)
        free_b.remove(j)


times = st.lists(st.integers(0, 60), max_size=12).map(lambda values: np.array(values) / 64)


@given(times, times)
def test_association_is_the_greedy_one(a, b):
    limit = 4 / 64
    i, j = associate(a, b, limit)
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == associate_by_force(a, b, limit)


def test_association_of_two_clocks():
    a = np.arange(100) / 30
    b = a[::-1] + 0.004
    i, j = associate(a, b)
    np.testing.assert_array_equal(i, np.arange(100))
    np.testing.assert_array_equal(j, np.arange(100)[::-1])


def test_association_of_nothing():
    i, j = associate([], [1.0, 2.0])
    assert len(i) == len(j) == 0
    with pytest.raises(ValueError, match="timestamps_a must be a list of finite times"):
        associate([[1.0]], [1.0])


@pytest.mark.data
def test_real_trajectories(recordings):
    truth = read_trajectory(recordings / "tum-fr3-teddy" / "groundtruth.txt")
    assert len(truth) == 8080
    estimate = read_trajectory(recordings / "redwood-livingroom1" / "o3d_estimated_trajectory.log")
    assert len(estimate) == 211
    np.testing.assert_array_equal(estimate.timestamps, np.arange(211))


def test_a_file_of_many_poses_is_read_whole_and_errors_name_their_line(tmp_path):
    path = tmp_path / "many.txt"
    poses = np.tile(np.eye(4), (2500, 1, 1))
    poses[:, 0, 3] = np.arange(2500)
    write_trajectory(path, np.arange(2500), poses)
    read = read_trajectory(path)
    np.testing.assert_array_equal(read.poses, poses)
    np.testing.assert_array_equal(read.timestamps, np.arange(2500))
    path.write_text("0 0 0 0 0 0 0 1\n" * 2000 + "0 0 0 0 0 0 0 0\n")
    with pytest.raises(FileFormatError, match="line 2001: the quaternion is 0"):
        read_trajectory(path)


@pytest.mark.parametrize("format", ["tum", "redwood", "kitti"])
def test_every_format_is_read_again(tmp_path, format):
    poses = random_poses(1500, seed=8)
    write_trajectory(tmp_path / "t.txt", np.arange(1500) + 3, poses, format=format)
    found = read_trajectory(tmp_path / "t.txt")
    np.testing.assert_allclose(found.poses, poses, atol=1e-12)
    np.testing.assert_array_equal(found.timestamps, np.arange(1500) + (0 if format == "kitti" else 3))


def test_the_ending_log_means_redwood(tmp_path):
    write_trajectory(tmp_path / "t.log", [0.5, 1.5], np.tile(np.eye(4), (2, 1, 1)))
    assert (tmp_path / "t.log").read_text() == "".join(
        f"{i} {i} {i + 1}\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n" for i in range(2)
    )


def test_lines_of_kitti(tmp_path):
    """As its development kit has them: the rows of a 3x4 matrix, one after the other."""
    pose = np.eye(4)
    pose[:3] = [[0, -1, 0, 1.5], [1, 0, 0, 2], [0, 0, 1, 3]]
    write_trajectory(tmp_path / "t.txt", [7], [pose], format="kitti")
    assert (tmp_path / "t.txt").read_text() == "0 -1 0 1.5 1 0 0 2 0 0 1 3\n"
    (tmp_path / "t.txt").write_text("1.000000e+00 9e-12 0 0 -9e-12 1 0 0 0 0 1 -2e-1\n")  # as the benchmark's
    assert read_trajectory(tmp_path / "t.txt").poses[0, 2, 3] == -0.2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1\n", "line 2: expected 12 numbers .*, got 11"),
        ("1 0 0 0 0 1 0 0 0 0 2 0\n", "line 1: the matrix is not a rotation"),
        ("1 0 0 0 0 1 0 0 0 0 1 nan\n", "line 1: expected finite numbers"),
    ],
)  # fmt: skip
def test_lines_that_are_not_of_kitti(tmp_path, text, message):
    (tmp_path / "t.txt").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_trajectory(tmp_path / "t.txt")


@pytest.mark.parametrize("format", ["tum", "redwood", "kitti"])
def test_no_poses_are_not_written_as_no_file_of_them_is_read(tmp_path, format):
    for trajectory in ([Trajectory([], np.zeros((0, 4, 4)))], ([], np.zeros((0, 4, 4)))):
        with pytest.raises(ValueError, match="poses must be at least one, got none"):
            write_trajectory(tmp_path / "t.txt", *trajectory, format=format)
    assert not list(tmp_path.iterdir())
    (tmp_path / "t.txt").write_text("# timestamp tx ty tz qx qy qz qw\n")
    with pytest.raises(FileFormatError, match="the trajectory is empty"):
        read_trajectory(tmp_path / "t.txt")


def test_an_unknown_format(tmp_path):
    with pytest.raises(ValueError, match="format must be one of tum, redwood, kitti, got 'euroc'"):
        write_trajectory(tmp_path / "t.txt", [0], [np.eye(4)], format="euroc")
    assert not list(tmp_path.iterdir())
