"""Point files of every format, as they are read again and as other programs see them."""

import contextlib
import datetime

import numpy as np
import pytest

import nacre
from nacre.io.points import SUFFIXES

RNG = np.random.default_rng(4)
POINTS = RNG.normal(size=(50, 3))
NORMALS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
COLORS = RNG.integers(0, 256, (50, 3)).astype(np.uint8)
CONFIDENCE = RNG.random(50).astype(np.float32)
NEEDS = {".las": "laspy", ".laz": "laspy", ".e57": "pye57"}
OWN = sorted(set(SUFFIXES) - {".ply", ".pcd"})  # the others have files of their own

# A church in Zurich [m]: with float32 its coordinates would be good to half a metre.
GEOREFERENCED = RNG.uniform(0, 80, (50, 3)) + np.array([2_683_141.123, 1_247_412.456, 408.789])
STEPS = {".las": 0.5e-6, ".laz": 0.5e-6, ".e57": 5e-6, ".xyz": 0, ".npz": 0, ".ply": 0, ".pcd": 0}


@pytest.fixture(params=SUFFIXES)
def suffix(request):
    pytest.importorskip(NEEDS.get(request.param, "numpy"))
    return request.param


def written(path, points=POINTS, **more):
    pytest.importorskip(NEEDS.get(path.suffix, "numpy"))
    nacre.write_points(path, points, **more)
    return path


def test_points_and_colours_are_read_again(tmp_path, suffix):
    cloud = nacre.read_points(written(tmp_path / f"a{suffix}", colors=COLORS))
    np.testing.assert_allclose(cloud.points, POINTS, rtol=0, atol=STEPS[suffix] + 1e-15)
    np.testing.assert_array_equal(cloud.colors, COLORS, strict=True)
    assert (cloud.normals, cloud.attributes, cloud.shape) == (None, {}, None)
    assert cloud.path == tmp_path / f"a{suffix}"


def test_georeferenced_points_keep_their_digits(tmp_path, suffix):
    cloud = nacre.read_points(written(tmp_path / f"a{suffix}", GEOREFERENCED))
    assert cloud.points.dtype == np.float64
    np.testing.assert_allclose(cloud.points, GEOREFERENCED, rtol=0, atol=STEPS[suffix] + 1e-9)


def test_normals_and_confidence_are_read_again(tmp_path, suffix):
    attributes = {"confidence": CONFIDENCE}
    told = pytest.warns(UserWarning, match=r"\.e57 files have no place for confidence")
    with told if suffix == ".e57" else contextlib.nullcontext():
        path = written(tmp_path / f"a{suffix}", normals=NORMALS, attributes=attributes)
    cloud = nacre.read_points(path)
    if suffix == ".e57":
        np.testing.assert_array_equal(cloud.normals, NORMALS.astype(np.float32))
        assert cloud.attributes == {}
        return
    np.testing.assert_array_equal(cloud.normals, NORMALS)
    np.testing.assert_array_equal(cloud.attributes["confidence"].astype(np.float32), CONFIDENCE)


@pytest.mark.parametrize("ending", [".ply", ".pcd", ".npz", ".las", ".laz", ".copc.laz", ".e57"])
def test_comments_are_read_again(tmp_path, ending):
    comments = ("made of café", "", "second line")
    assert nacre.read_points(written(tmp_path / f"a{ending}", comments=comments)).comments == comments
    assert nacre.read_points(written(tmp_path / f"b{ending}")).comments == ()


@pytest.mark.parametrize("intensity", [np.arange(50, dtype=np.uint16) * 1000, np.linspace(0, 1, 50)])
def test_intensity_is_read_again(tmp_path, suffix, intensity):
    found = nacre.read_points(written(tmp_path / f"a{suffix}", attributes={"intensity": intensity}))
    stored = found.attributes["intensity"]
    scale = 65535 if suffix in (".las", ".laz") and intensity.dtype.kind == "f" else 1
    np.testing.assert_allclose(stored / scale, intensity, atol=1e-5)


def test_files_without_points(tmp_path, suffix):
    if suffix == ".e57":
        with pytest.raises(ValueError, match="points must be finite, and at least one, in an E57 file"):
            written(tmp_path / "a.e57", np.zeros((0, 3)))
        return
    cloud = nacre.read_points(
        written(tmp_path / f"a{suffix}", np.zeros((0, 3)), colors=np.zeros((0, 3), int))
    )
    assert cloud.points.shape == (0, 3)


@pytest.mark.parametrize("ending", [".las", ".laz"])
def test_laspy_sees_a_survey(tmp_path, ending):
    laspy = pytest.importorskip("laspy")
    attributes = {"classification": np.full(50, 6), "gps_time": np.arange(50.0), "last_seen": np.arange(50)}
    path = written(tmp_path / f"a{ending}", GEOREFERENCED, colors=COLORS, attributes=attributes)
    las = laspy.read(path)
    assert (str(las.header.version), las.header.point_format.id, las.header.are_points_compressed) == (
        "1.4", 7, ending == ".laz",
    )  # fmt: skip
    np.testing.assert_allclose(las.xyz, GEOREFERENCED, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(las.red // 257, COLORS[:, 0])
    assert set(np.asarray(las.return_number)) == set(np.asarray(las.number_of_returns)) == {1}
    assert (set(las.classification), las.gps_time[7], las.last_seen[7]) == ({6}, 7.0, 7)
    again = nacre.read_points(path).attributes
    assert set(again) == set(attributes)


@pytest.mark.parametrize("ending", [".las", ".laz", ".copc.laz"])
def test_the_same_survey_has_the_same_bytes_on_another_day(tmp_path, monkeypatch, ending):
    laspy = pytest.importorskip("laspy")
    today = written(tmp_path / f"today{ending}", GEOREFERENCED, colors=COLORS)

    class Later(datetime.date):
        @classmethod
        def today(cls):
            return cls(2087, 6, 5)

    monkeypatch.setattr("laspy.header.date", Later)
    later = written(tmp_path / f"later{ending}", GEOREFERENCED, colors=COLORS)
    assert today.read_bytes() == later.read_bytes()
    assert laspy.read(later).header.creation_date is None
    np.testing.assert_allclose(
        np.sort(laspy.read(later).xyz, axis=0), np.sort(GEOREFERENCED, axis=0), atol=1e-6
    )


def test_a_las_file_of_another_program(tmp_path):
    """LAS 1.2 with colours of 8 bits and the millimetres of its own scale."""
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.offsets, header.scales = np.array([2_683_000, 1_247_000, 400]), np.full(3, 0.001)
    las = laspy.LasData(header)
    las.xyz = GEOREFERENCED
    las.red, las.green, las.blue = COLORS.T.astype(np.uint16)
    las.write(tmp_path / "a.las")
    cloud = nacre.read_points(tmp_path / "a.las")
    np.testing.assert_allclose(cloud.points, GEOREFERENCED, rtol=0, atol=0.5001e-3)
    np.testing.assert_array_equal(cloud.colors, COLORS)
    nacre.write_points(tmp_path / "b.laz", cloud.points)
    np.testing.assert_allclose(nacre.read_points(tmp_path / "b.laz").points, cloud.points, rtol=0, atol=1e-6)


def test_a_las_file_that_describes_itself(tmp_path):
    laspy = pytest.importorskip("laspy")
    las = laspy.read(written(tmp_path / "a.las", comments=["by hand", "é"]))
    (record,) = las.vlrs
    assert (record.user_id, record.record_id) == ("LASF_Spec", 3)
    assert record.record_data == "by hand\né".encode() + b"\0"
    record.record_data = b"another's\0no text"
    las.write(tmp_path / "b.las")
    assert nacre.read_points(tmp_path / "b.las").comments == ("another's",)


def test_comments_that_a_las_file_has_no_place_for(tmp_path):
    with pytest.warns(UserWarning, match="no place for comments of more than 65534 bytes"):
        path = written(tmp_path / "a.las", comments=["é" * 40_000])
    assert nacre.read_points(path).comments == ("é" * 32_767,)


def test_points_far_apart_get_coarser_steps(tmp_path):
    points = np.array([[-9e6, 0, 0], [9e6, 1.5, 2.5]])
    cloud = nacre.read_points(written(tmp_path / "a.las", points))
    np.testing.assert_allclose(cloud.points, points, rtol=0, atol=0.005)


def test_pye57_sees_one_scan(tmp_path):
    pye57 = pytest.importorskip("pye57")
    path = written(
        tmp_path / "a.e57",
        GEOREFERENCED,
        normals=NORMALS,
        colors=COLORS,
        attributes={"intensity": CONFIDENCE},
    )
    with pye57.E57(str(path)) as file:
        assert file.scan_count == 1
        assert set(file.get_header(0).point_fields) >= {"nor:normalX", "nor:normalY", "nor:normalZ"}
        scan = file.read_scan(0, intensity=True, colors=True, ignore_missing_fields=True)
    np.testing.assert_allclose(scan["cartesianX"], GEOREFERENCED[:, 0], rtol=0, atol=5e-6)
    np.testing.assert_array_equal(scan["colorGreen"], COLORS[:, 1])
    np.testing.assert_array_equal(scan["intensity"], CONFIDENCE)


def test_scans_of_e57_come_together_in_their_places(tmp_path):
    pye57 = pytest.importorskip("pye57")
    half_a_turn = np.array([0.0, 0, 0, 1])  # about z: w x y z
    with pye57.E57(str(tmp_path / "a.e57"), mode="w") as file:
        for rotation, translation in (
            (np.array([1.0, 0, 0, 0]), np.zeros(3)),
            (half_a_turn, np.array([9.0, 0, 0])),
        ):
            axes = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), np.eye(3) + 1, strict=True))
            file.write_scan_raw(axes, rotation=rotation, translation=translation)
    cloud = nacre.read_points(tmp_path / "a.e57")
    np.testing.assert_allclose(cloud.points[:3], np.eye(3) + 1)
    np.testing.assert_allclose(cloud.points[3:], (np.eye(3) + 1) * (-1, -1, 1) + (9, 0, 0), atol=1e-6)


def test_normals_of_e57_turn_with_their_scan(tmp_path):
    """Two scans of another program, the second by a quarter of a turn about z, with an invalid point."""
    pye57 = pytest.importorskip("pye57")
    lib = pye57.libe57
    quarter = np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])  # w x y z
    with pye57.E57(str(tmp_path / "a.e57"), mode="w") as file:
        image = file.image_file
        image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
        for rotation in (np.array([1.0, 0, 0, 0]), quarter):
            columns = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), np.eye(3) + 1, strict=True))
            columns |= dict(zip(("nor:normalX", "nor:normalY", "nor:normalZ"), np.eye(3)[::-1], strict=True))
            columns["cartesianInvalidState"] = np.array([0, 2, 0], np.uint8)
            prototype, buffers = lib.StructureNode(image), lib.VectorSourceDestBuffer()
            for name, values in columns.items():
                is_state = name == "cartesianInvalidState"
                node = lib.IntegerNode(image, 0, 0, 2) if is_state else lib.FloatNode(image, 0.0)
                prototype.set(name, node)
                buffers.append(lib.SourceDestBuffer(image, name, values, 3, True, True))
            turn, pose, scan = (lib.StructureNode(image) for _ in range(3))
            for axis, part in zip("wxyz", rotation, strict=True):
                turn.set(axis, lib.FloatNode(image, part))
            pose.set("rotation", turn)
            scan.set("pose", pose)
            points = lib.CompressedVectorNode(image, prototype, lib.VectorNode(image, True))
            scan.set("points", points)
            file.data3d.append(scan)
            writer = points.writer(buffers)
            writer.write(3)
            writer.close()
    normals = nacre.read_points(tmp_path / "a.e57").normals
    np.testing.assert_allclose(normals, [[0, 0, 1], [1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-6)


def test_a_normal_that_is_not_known_stays_so(tmp_path):
    normals = NORMALS.copy()
    normals[7] = np.nan
    found = nacre.read_points(written(tmp_path / "a.e57", normals=normals)).normals
    np.testing.assert_array_equal(found, normals.astype(np.float32))


def test_numpy_sees_the_arrays(tmp_path):
    path = written(tmp_path / "a.npz", normals=NORMALS, attributes={"file": CONFIDENCE}, comments=["café"])
    with np.load(path) as arrays:
        assert set(arrays) == {"points", "normals", "file", "comments"}
        np.testing.assert_array_equal(arrays["points"], POINTS, strict=True)
    np.savez_compressed(tmp_path / "b.npz", points=POINTS.astype(np.float32), times=np.arange(50))
    cloud = nacre.read_points(tmp_path / "b.npz")
    assert (cloud.points.dtype, cloud.attributes["times"].dtype) == (np.float32, np.int64)
    assert nacre.read_points(path).comments == ("café",)


def test_numpy_sees_the_text(tmp_path):
    path = written(tmp_path / "a.xyz", normals=NORMALS, colors=COLORS, attributes={"q": np.ones((50, 2))})
    assert path.read_text().startswith("# x y z red green blue nx ny nz q_0 q_1\n")
    np.testing.assert_array_equal(np.loadtxt(path)[:, :9], np.hstack([POINTS, COLORS, NORMALS]))


def read_text(tmp_path, text):
    (tmp_path / "a.xyz").write_text(text)
    return nacre.read_points(tmp_path / "a.xyz")


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("1 2 3\n4 5 6\n", set()),
        ("1,2,3\r\n4,5,6", set()),
        ("\n1;2;3\n\n4\t5\t6\n\n", set()),
        ("# by hand\n// X Y Z\n1 2 3\n4 5 6\n", set()),
        ("1 2 3 0.5\n4 5 6 0.25\n", {"intensity"}),
        ("1 2 3 255 0 7\n4 5 6 0 0 0\n", {"colors"}),
        ("1 2 3 0 0 1\n4 5 6 0.6 0 -0.8\n", {"normals"}),
        ("1 2 3 9 255 0 7\n4 5 6 8 0 0 0\n", {"colors", "intensity"}),
        ("1 2 3 255 0 7 9.5\n4 5 6 0 0 0 8\n", {"colors", "intensity"}),
        ("1 2 3 255 0 7 0 0 1\n4 5 6 0 0 0 0 1 0\n", {"colors", "normals"}),
        ("1 2 3 0 0.6 0.8 255 0 7\n4 5 6 0 1 0 0 0 0\n", {"colors", "normals"}),
        ("X,Y,Z,Time\n1,2,3,7\n4,5,6,8\n", {"time"}),
        ("//X Y Z R G B\n1 2 3 0.5 0 1\n4 5 6 0 0 1\n", {"red", "green", "blue"}),
    ],
)
def test_texts_of_other_programs(tmp_path, text, fields):
    cloud = read_text(tmp_path, text)
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [4, 5, 6]], strict=False)
    found = {name for name in ("normals", "colors") if getattr(cloud, name) is not None}
    assert found | set(cloud.attributes) == fields


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: there is no point"),
        ("# by hand\n\n", "there is no point"),
        ("1 2 3\n4 5\n", "line 2: expected 3 values, found 2"),
        ("# c\n1 2\n", "line 2: expected x y z, then r g b"),
        ("1 2 3 4 5\n", "expected x y z, .* or a first line of names; got '1 2 3 4 5'"),
        ("1 2 3 300 0 0\n", "expected x y z"),
        ("1 2 z\n", "line 1: 'z' is not a number"),
        ("1 2 1_0\n", "line 1: '1_0' is not a number"),
        ("x y z q\n1 2 3\n", "line 2: expected 4 values, found 3"),
    ],
)
def test_texts_that_are_none(tmp_path, text, message):
    with pytest.raises(nacre.FileFormatError, match=message):
        read_text(tmp_path, text)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"vertices": POINTS}, "no array points in it, but vertices"),
        ({"points": POINTS[:, :2]}, r"points must have shape \(N, 3\), got \(50, 2\)"),
        ({"points": POINTS, "normals": NORMALS[:5]}, "normals must have one row per point"),
        ({"points": POINTS, "colors": COLORS + 0.5}, "colors must be integers"),
        ({"points": POINTS, "times": np.arange(4)}, "times"),
        ({"points": POINTS, "comments": np.arange(4)}, "comments must be a list of texts"),
        ({"points": POINTS.astype(object)}, "points must be an array of numbers"),
    ],
)
def test_arrays_that_do_not_fit(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(nacre.FileFormatError, match=message):
        nacre.read_points(tmp_path / "a.npz")


@pytest.mark.parametrize("ending", [".las", ".laz", ".e57", ".npz"])
def test_damaged_files(tmp_path, ending):
    path = written(tmp_path / f"a{ending}")
    whole = path.read_bytes()
    damages = [b"", b"x", bytes(500), *(whole[: len(whole) * k // 7] for k in range(7))]
    for damage in damages:
        path.write_bytes(damage)
        with pytest.raises(nacre.FileFormatError, match=rf"a\{ending}"):
            nacre.read_points(path)


@pytest.mark.parametrize("ending", OWN)
def test_files_that_are_not_there(tmp_path, ending):
    pytest.importorskip(NEEDS.get(ending, "numpy"))
    with pytest.raises(FileNotFoundError):
        nacre.read_points(tmp_path / f"a{ending}")
    (tmp_path / f"a{ending}").mkdir()
    with pytest.raises(IsADirectoryError):
        nacre.read_points(tmp_path / f"a{ending}")


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("a.las", {"points": [[0, 0, np.nan]]}, "points must be finite in a LAS file"),
        ("a.e57", {"points": [[0, np.inf, 0]]}, "points must be finite, and at least one"),
        ("a.las", {"attributes": {"classification": [0.5]}}, r"classification.* whole numbers .* got 0\.5"),
        ("a.las", {"attributes": {"intensity": [-1.5]}}, r"from 0 to 65535 or real ones from 0 to 1"),
        ("a.las", {"attributes": {"return_number": [16]}}, "whole numbers from 0 to 15 .* got 16"),
        ("a.las", {"attributes": {"q": np.ones((1, 4))}}, r"1 to 3 values per point .*\(1, 4\)"),
        ("a.las", {"attributes": {"q" * 33: [1]}}, "a name of at most 32 letters"),
        ("a.las", {"attributes": {"red": [1]}}, "attributes must not be called 'red'"),
        ("a.xyz", {"attributes": {"a,b": [1]}}, "attributes must not be called 'a,b'"),
        ("a.xyz", {"attributes": {"x": [1]}}, "attributes must not be called 'x'"),
        ("a.npz", {"attributes": {"points": [1]}}, "attributes must not be called 'points'"),
        ("a.npz", {"attributes": {"a/b": [1]}}, "attributes must not be called 'a/b'"),
        ("a.xyz", {"comments": "one"}, "comments must be a sequence of strings"),
        ("a.obj", {}, r"point files end in \.ply, .*\.npz, got .*a\.obj"),
    ],
)  # fmt: skip
def test_illegal_arguments_write_nothing(tmp_path, name, arguments, message):
    with pytest.raises((ValueError, TypeError), match=message):
        written(tmp_path / name, **{"points": POINTS[:1], **arguments})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", NEEDS)
@pytest.mark.parametrize("write", [True, False])
def test_what_is_missing_is_said(tmp_path, monkeypatch, ending, write):
    extra = "e57" if ending == ".e57" else "las"
    monkeypatch.setitem(__import__("sys").modules, NEEDS[ending], None)
    with pytest.raises(ImportError, match=rf'pip install "nacre\[{extra}\]"'):
        nacre.write_points(tmp_path / f"a{ending}", POINTS) if write else nacre.read_points(
            tmp_path / f"a{ending}"
        )


def test_an_e57_file_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    """The library's own error says nothing of it, and leaves what was written so far."""
    pye57 = pytest.importorskip("pye57")

    def fail(*_, **__):
        raise pye57.libe57.E57Exception("write() failed\nin a source file")

    monkeypatch.setattr(pye57.libe57, "CompressedVectorNode", fail)
    (tmp_path / "a.e57").write_bytes(b"before")
    with pytest.raises(OSError, match=r"write\(\) failed: '.*a\.e57'") as caught:
        nacre.write_points(tmp_path / "a.e57", POINTS)
    assert caught.value.filename == str(tmp_path / "a.e57")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"before"]
