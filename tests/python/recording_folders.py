"""Recordings of every format, written for tests."""

import numpy as np

import nacre
from nacre import Camera
from nacre._internal.quaternions import matrix_from_quaternion, quaternion_from_matrix
from nacre.io.images import write_color_png, write_depth_png

WIDTH, HEIGHT = 640, 480
SMALL = Camera(width=8, height=6, fx=10, fy=11, cx=3.5, cy=2.5)


def stored(index, shape=(HEIGHT, WIDTH)):
    """Return a depth image that says which one it is, with pixels without a measurement."""
    image = np.full(shape, 5000 + index, dtype=np.uint16)
    image[0, :2] = 0, 65535
    return image


def colors(index, shape=(HEIGHT, WIDTH)):
    return np.full((*shape, 3), (index, 100, 200), dtype=np.uint8)


def pose(index):
    result = np.eye(4)
    result[:3, :3] = matrix_from_quaternion([0.1 * index, -0.2, 0.3, 1.0])
    result[:3, 3] = 0.1 * index, 0.2, -0.3
    return result


def tum_line(time, matrix):
    return (
        " ".join(f"{x:.9f}" for x in (time, *matrix[:3, 3], *quaternion_from_matrix(matrix[:3, :3]))) + "\n"
    )


def matrix_lines(matrix):
    return "".join(" ".join(f"{x:.9f}" for x in row) + "\n" for row in matrix)


def write_views(folder, names, depth="depth", color=None, shape=(HEIGHT, WIDTH)):
    (folder / depth).mkdir(parents=True, exist_ok=True)
    for index, name in enumerate(names):
        write_depth_png(folder / depth / f"{name}.png", stored(index, shape))
    if color is not None:
        (folder / color).mkdir(exist_ok=True)
        for index, name in enumerate(names):
            write_color_png(folder / color / f"{name}.png", colors(index, shape))


def write_tum(folder, comment="# file: 'rgbd_dataset_freiburg3_teddy.bag'\n", truth=True):
    times = [100.0 + 0.1 * i for i in range(4)]
    write_views(folder, [f"{t:.6f}" for t in times], color="rgb")
    header = "# timestamp filename\n"
    (folder / "depth.txt").write_text(header + "".join(f"{t:.6f} depth/{t:.6f}.png\n" for t in times))
    # The second colour image is too late for its depth image.
    late = [t + (0.05 if i == 1 else 0.01) for i, t in enumerate(times)]
    lines = [f"{stamp:.6f} rgb/{t:.6f}.png\n" for stamp, t in zip(late, times, strict=True)]
    (folder / "rgb.txt").write_text(header + "".join(lines))
    if truth:
        ends = [(t + shift, pose(i)) for i, t in enumerate(times[:3]) for shift in (-0.01, 0.01)]
        (folder / "groundtruth.txt").write_text(comment + "".join(tum_line(*end) for end in ends))
    return folder


def write_redwood(folder, color="image"):
    write_views(folder, [f"{i:05d}" for i in range(3)], color=color)
    return folder


def write_seven_scenes(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(3):
        write_depth_png(folder / f"frame-{i:06d}.depth.png", stored(i))
        write_color_png(folder / f"frame-{i:06d}.color.png", colors(i))
        text = matrix_lines(pose(i)) if i != 1 else "-1.#IND " * 4 + "\n"
        (folder / f"frame-{i:06d}.pose.txt").write_text(text)
    return folder


def write_icl_nuim(folder):
    write_views(folder, ["0", "1", "2"], color="rgb")
    (folder / "associations.txt").write_text(
        "".join(f"{i} depth/{i}.png {i} rgb/{i}.png\n" for i in range(3))
    )
    (folder / "livingRoom1.gt.freiburg").write_text("".join(tum_line(i, pose(i)) for i in (1, 2)))
    return folder


def write_plain(folder, suffix=".png"):
    frames = [stored(i, (6, 8)) for i in range(3)]
    (folder / "depth").mkdir(parents=True)
    nacre.write_camera(folder / "camera.json", SMALL, 1000)
    for i, frame in enumerate(frames):
        path = folder / "depth" / f"view{i}{suffix}"
        if suffix == ".png":
            write_depth_png(path, frame)
        elif suffix == ".npy":
            np.save(path, frame.astype(np.float32))
        else:
            path.write_bytes(b"P5 8 6 65535\n" + frame.astype(">u2").tobytes())
    return folder


def check_depth(frame, expected):
    assert frame.depth.dtype == np.float32
    assert np.isnan(frame.depth[0, :2]).all()
    np.testing.assert_allclose(frame.depth[1:], expected, rtol=1e-6)
