"""What PLY and PCD files share: nothing is lost or half written, errors name the argument."""

import errno
import pickle
import tracemalloc

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre

FILES = pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd"])
ENCODINGS = pytest.mark.parametrize("binary", [True, False])
PLY_DTYPES = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
NAMES = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=8).map("a".__add__)


def equal(a, b):
    """Equal bit for bit, but for the kind of a NaN, which text does not keep."""
    return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")


@st.composite
def clouds(draw, dtypes):
    n = draw(st.integers(0, 20))
    floats = st.sampled_from(["f4", "f8"])
    arguments = {"points": draw(hnp.arrays(draw(floats), (n, 3)))}
    if draw(st.booleans()):
        arguments["normals"] = draw(hnp.arrays(draw(floats), (n, 3)))
    if draw(st.booleans()):
        arguments["colors"] = draw(hnp.arrays("u1", (n, 3)))
    shapes = st.one_of(st.just((n,)), st.integers(2, 4).map(lambda k: (n, k)))
    columns = st.builds(lambda dtype, shape: (dtype, shape), st.sampled_from(dtypes), shapes).flatmap(
        lambda entry: hnp.arrays(*entry)
    )
    arguments["attributes"] = draw(st.dictionaries(NAMES, columns, max_size=3))
    arguments["comments"] = draw(st.lists(st.text(max_size=10).map(str.strip), max_size=3))
    return arguments


def check_round_trip(path, arguments, binary):
    points = arguments.pop("points")
    nacre.write_points(path, points, binary=binary, **arguments)
    cloud = nacre.read_points(path)
    assert equal(cloud.points, points)
    for name in ("normals", "colors"):
        expected = arguments.get(name)
        read = getattr(cloud, name)
        assert read is None if expected is None else equal(read, expected)
    assert list(cloud.attributes) == list(arguments["attributes"])
    for name, expected in arguments["attributes"].items():
        if len(points):  # no list says how long it would have been
            assert equal(cloud.attributes[name], expected)
        assert cloud.attributes[name].dtype == expected.dtype
    lines = [line.strip() for text in arguments["comments"] for line in text.splitlines() or [""]]
    assert list(cloud.comments) == lines
    for array in (cloud.points, cloud.normals, cloud.colors, *cloud.attributes.values()):
        assert array is None or (array.flags.c_contiguous and array.flags.writeable)


@ENCODINGS
@settings(max_examples=60, deadline=None, derandomize=True)
@given(arguments=clouds(PLY_DTYPES))
def test_ply_round_trip(tmp_path_factory, binary, arguments):
    check_round_trip(tmp_path_factory.getbasetemp() / "round.ply", arguments, binary)


@ENCODINGS
@settings(max_examples=60, deadline=None, derandomize=True)
@given(arguments=clouds((*PLY_DTYPES, "i8", "u8")))
def test_pcd_round_trip(tmp_path_factory, binary, arguments):
    check_round_trip(tmp_path_factory.getbasetemp() / "round.pcd", arguments, binary)


@FILES
@ENCODINGS
def test_far_away_coordinates_keep_their_digits(tmp_path, name, binary):
    points = np.array([[4.5e6 + 1e-7, -5.1e6 + 3e-9, 1 / 3]])
    nacre.write_points(tmp_path / name, points, binary=binary)
    assert equal(nacre.read_points(tmp_path / name).points, points)


@FILES
@ENCODINGS
def test_special_values(tmp_path, name, binary):
    tiny = np.float32(1e-45)
    points = np.array([[np.nan, np.inf, -np.inf], [-0.0, tiny, np.finfo(np.float32).max]], dtype=np.float32)
    nacre.write_points(tmp_path / name, points, binary=binary)
    read = nacre.read_points(tmp_path / name).points
    assert equal(read, points)
    assert np.signbit(read[1, 0])


@FILES
@pytest.mark.parametrize("shape", [(0, 3), (1, 3), (70_000, 3)])
def test_sizes_across_blocks(tmp_path, name, shape):
    points = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    index = np.arange(len(points), dtype=np.uint32)
    for binary in (True, False):
        nacre.write_points(tmp_path / name, points, attributes={"index": index}, binary=binary)
        cloud = nacre.read_points(tmp_path / name)
        assert len(cloud) == shape[0]
        assert equal(cloud.points, points)
        assert equal(cloud.attributes["index"], index)


@FILES
@pytest.mark.parametrize(
    "points",
    [
        np.arange(12).reshape(4, 3),
        np.asfortranarray(np.arange(12.0).reshape(4, 3)),
        np.arange(24.0)[::2].reshape(4, 3).astype(">f8"),
        np.arange(12, dtype=np.float16).reshape(4, 3),
        np.arange(24, dtype=np.float32).reshape(4, 6)[:, ::2],
        [[0, 1, 2]],
    ],
)
def test_any_real_dtype_and_layout(tmp_path, name, points):
    nacre.write_points(tmp_path / name, points, normals=points, attributes={"a": np.asarray(points)[:, 0]})
    cloud = nacre.read_points(tmp_path / name)
    np.testing.assert_array_equal(cloud.points, points)
    np.testing.assert_array_equal(cloud.normals, points)
    np.testing.assert_array_equal(cloud.attributes["a"], np.asarray(points)[:, 0])


@FILES
def test_attributes_of_types_without_a_name_in_the_format(tmp_path, name):
    points = np.zeros((2, 3), dtype=np.float32)
    attributes = {
        "flag": np.array([True, False]),
        "half": np.array([0.5, 2], dtype=np.float16),
        "count": [1, -1],
    }
    nacre.write_points(tmp_path / name, points, attributes=attributes)
    read = nacre.read_points(tmp_path / name).attributes
    assert equal(read["flag"], np.array([1, 0], dtype=np.uint8))
    assert equal(read["half"], np.array([0.5, 2], dtype=np.float32))
    np.testing.assert_array_equal(read["count"], [1, -1])


def test_ply_has_no_large_integers(tmp_path):
    points = np.zeros((1, 3))
    nacre.write_points(tmp_path / "a.ply", points, attributes={"id": np.array([2**32 - 1])})
    assert equal(
        nacre.read_points(tmp_path / "a.ply").attributes["id"], np.array([2**32 - 1], dtype=np.uint32)
    )
    with pytest.raises(ValueError, match=r"attributes\['id'\].*32-bit"):
        nacre.write_points(tmp_path / "a.ply", points, attributes={"id": np.array([2**32])})


def test_representation(tmp_path):
    nacre.write_points(
        tmp_path / "a.ply", np.zeros((2, 3)), colors=np.zeros((2, 3), int), attributes={"t": [1, 2]}
    )
    cloud = nacre.read_points(tmp_path / "a.ply")
    assert repr(cloud) == f"Cloud(2 points, float64, colors, t: int32, path={str(tmp_path / 'a.ply')!r})"
    with pytest.raises(AttributeError):
        cloud.points = None


@pytest.mark.parametrize("name", ["cloud.PLY", "cloud.Pcd"])
def test_suffix_in_capitals(tmp_path, name):
    nacre.write_points(str(tmp_path / name), np.ones((1, 3)))
    assert len(nacre.read_points(str(tmp_path / name))) == 1


@pytest.mark.parametrize("name", ["cloud.pts", "cloud", "ply"])
def test_unknown_suffix(tmp_path, name):
    with pytest.raises(ValueError, match=r"\.ply, \.pcd, .*\.npz, got .*" + name):
        nacre.read_points(tmp_path / name)
    with pytest.raises(ValueError, match=r"\.ply, \.pcd, .*\.npz, got .*" + name):
        nacre.write_points(tmp_path / name, np.zeros((1, 3)))


@FILES
def test_missing_file(tmp_path, name):
    with pytest.raises(FileNotFoundError, match=name):
        nacre.read_points(tmp_path / name)


@FILES
def test_directory(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(IsADirectoryError, match=name):
        nacre.read_points(tmp_path / name)
    with pytest.raises(IsADirectoryError, match=name):
        nacre.write_points(tmp_path / name, np.zeros((1, 3)))
    assert list(tmp_path.iterdir()) == [tmp_path / name]


@FILES
def test_a_pipe_would_never_end(tmp_path, name):
    os = pytest.importorskip("os")
    os.mkfifo(tmp_path / name)
    with pytest.raises(nacre.FileFormatError, match="not a regular file"):
        nacre.read_points(tmp_path / name)


ONE = np.zeros((1, 3))


@FILES
@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"points": np.zeros(3)}, ValueError, r"points must have shape \(N, 3\)"),
        ({"points": [["a", "b", "c"]]}, TypeError, "points must be an array of real numbers"),
        ({"points": ONE, "normals": np.zeros((2, 3))}, ValueError, "normals must have one row per point"),
        ({"points": ONE, "normals": np.zeros((1, 2))}, ValueError, r"normals must have shape \(N, 3\)"),
        ({"points": ONE, "colors": np.zeros((1, 4), int)}, ValueError, r"colors must have shape \(1, 3\)"),
        (
            {"points": ONE, "colors": 2 * ONE + 2},
            ValueError,
            "colors must be integers from 0 to 255 or floats from 0 to 1, got float64",
        ),
        ({"points": ONE, "colors": [[0, 0, 256]]}, ValueError, "colors must be integers from 0 to 255"),
        ({"points": ONE, "colors": [[0, 0, -1]]}, ValueError, "colors must be integers from 0 to 255"),
        (
            {"points": ONE, "attributes": {"a": [1, 2]}},
            ValueError,
            r"attributes\['a'\] must have shape \(1,\)",
        ),
        ({"points": ONE, "attributes": {"a": 1}}, ValueError, r"attributes\['a'\] must have shape"),
        ({"points": ONE, "attributes": {"a": [[[1]]]}}, ValueError, r"attributes\['a'\] must have shape"),
        ({"points": ONE, "attributes": {"a": ["b"]}}, TypeError, r"attributes\['a'\].*real numbers"),
        ({"points": ONE, "attributes": {"a": [1j]}}, TypeError, r"attributes\['a'\].*real numbers"),
        (
            {"points": ONE, "attributes": {"a b": [1]}},
            ValueError,
            "names of visible ASCII characters, got 'a b'",
        ),
        ({"points": ONE, "attributes": {"a\nb": [1]}}, ValueError, "names of visible ASCII characters"),
        ({"points": ONE, "attributes": {"": [1]}}, ValueError, "names of visible ASCII characters"),
        ({"points": ONE, "attributes": {"\u00e4": [1]}}, ValueError, "names of visible ASCII characters"),
        ({"points": ONE, "attributes": {"x": [1]}}, ValueError, "must not be called 'x'"),
        ({"points": ONE, "comments": "one"}, TypeError, "comments must be a sequence of strings"),
    ],
)
def test_illegal_arguments(tmp_path, name, arguments, error, message):
    with pytest.raises(error, match=message):
        nacre.write_points(tmp_path / name, **arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("attributes", "message"), [({"_": [1]}, "padding"), ({"a": np.zeros((1, 0))}, "at least one value")]
)
def test_what_pcd_cannot_hold(tmp_path, attributes, message):
    with pytest.raises(ValueError, match=message):
        nacre.write_points(tmp_path / "a.pcd", ONE, attributes=attributes)


@FILES
def test_a_full_disk_leaves_the_earlier_file(tmp_path, name):
    resource = pytest.importorskip("resource")
    nacre.write_points(tmp_path / name, ONE)
    before = (tmp_path / name).read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(OSError, match=name) as caught:
            nacre.write_points(tmp_path / name, np.zeros((100_000, 3)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.errno == errno.EFBIG
    assert caught.value.filename == str(tmp_path / name)
    assert (tmp_path / name).read_bytes() == before
    assert list(tmp_path.iterdir()) == [tmp_path / name]


@FILES
def test_folder_that_cannot_be_written(tmp_path, name):
    with pytest.raises(FileNotFoundError) as caught:
        nacre.write_points(tmp_path / "nowhere" / name, ONE)
    assert caught.value.filename == str(tmp_path / "nowhere" / name)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(NotADirectoryError) as caught:
        nacre.write_points(tmp_path / "file" / name, ONE)
    assert caught.value.filename == str(tmp_path / "file" / name)


@FILES
@ENCODINGS
def test_memory_is_bounded_by_the_file(tmp_path, name, binary):
    points = np.zeros((200_000, 3), dtype=np.float32)
    nacre.write_points(tmp_path / name, points, binary=binary)
    tracemalloc.start()
    try:
        nacre.read_points(tmp_path / name)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    allowance = (8 if not binary else 1) << 20  # a block of text as Python objects
    assert peak <= 4 * (tmp_path / name).stat().st_size + allowance


def test_format_error_travels_between_processes():
    error = pickle.loads(pickle.dumps(nacre.FileFormatError("a.ply", "no points", line=3)))
    assert str(error) == "a.ply, line 3: no points"
    assert isinstance(error, ValueError)
    assert (error.line, error.offset, error.reason) == (3, None, "no points")


@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_comments_are_bounded(tmp_path, suffix):
    path = tmp_path / f"cloud{suffix}"
    nacre.write_points(path, np.zeros((1, 3)), comments=["x"] * 10_000)
    assert len(nacre.read_points(path).comments) == 10_000
    with pytest.raises(ValueError, match="comments must be at most 10000 lines, got 10001"):
        nacre.write_points(path, np.zeros((1, 3)), comments=["x"] * 10_001)
