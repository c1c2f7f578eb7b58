"""Hostile camera files."""

import json

from hostile_files.case import single

PINHOLE = {
    "model": "pinhole",
    "width": 4,
    "height": 3,
    "fx": 5.0,
    "fy": 5.0,
    "cx": 1.5,
    "cy": 1.0,
    "depth_scale": 1000,
}
OPEN3D = {"width": 4, "height": 3, "intrinsic_matrix": [5, 0, 0, 0, 5, 0, 1.5, 1, 1]}


def changed(**values: object) -> str:
    """Return a camera file with some values changed."""
    return json.dumps({**PINHOLE, **values})


def raw(key: str, text: str) -> str:
    """Return a camera file with a value that is written so."""
    return changed(**{key: "@"}).replace('"@"', text)


TEXTS = {
    "empty": ("", "line 1: not a JSON file"),
    "nul bytes": ("\0" * 64, "line 1: not a JSON file"),
    "cut in the middle": (changed()[:40], "line 1: not a JSON file"),
    "goes on": (changed() + "}", "line 1: not a JSON file"),
    "python": (str(PINHOLE), "line 1: not a JSON file"),
    "a list": ("[1, 2]", "must hold a JSON object"),
    "a number": ("1", "must hold a JSON object"),
    "null": ("null", "must hold a JSON object"),
    "nested 100000 deep": ("[" * 100_000 + "]" * 100_000, "nested|larger"),
    "nested 20000 deep in a key": (raw("fx", '{"a":' * 5_000 + "1" + "}" * 5_000), "nested|fx must be"),
    "key twice": (changed().replace('"fy": 5.0', '"fy": 5.0, "fx": 50.0'), "the key 'fx' is there twice"),
    **{
        f"key {key} missing": (changed().replace(f'"{key}"', '"f"'), f"the key '{key}' is missing")
        for key in ("model", "width", "height", "fx", "fy", "cx", "cy")
    },
    **{
        f"{key} {what}": (changed(**{key: value}), f"{key} must be")
        for key, what, value in (
            ("model", "a number", 3),
            ("width", "a text", "640"),
            ("width", "true", True),
            ("height", "negative", -1),
            ("fx", "0", 0),
            ("fy", "a list", [525]),
            ("cx", "a word", "middle"),
            ("distortion", "of two", [0, 0]),
            ("distortion", "a number", 0),
            ("distortion", "of a word", [0, 0, 0, 0, "k3"]),
            ("depth_scale", "a text", "1000"),
        )
    },
    "comma after the last": ('{"model": "pinhole",}', "line 1: not a JSON file"),
    "nan": (raw("cx", "NaN"), "cx must be a finite number, got nan"),
    "infinite": (raw("cx", "-Infinity"), "cx must be a finite number, got -inf"),
    "1e400": (raw("fx", "1e400"), "fx must be a finite number, got inf"),
    "number of 400 digits": (raw("fx", "1" + "0" * 400), "fx must be a finite number"),
    "number of 5000 digits": (raw("fx", "1" + "0" * 5000), "not a JSON file|digits"),
    "fx negative zero": (raw("fx", "-0.0"), "fx"),
    "fx 1e-320": (raw("fx", "1e-320"), "fx"),
    "fx of text": (raw("fx", '"525"'), "fx must be a finite number, got '525'"),
    "fx true": (raw("fx", "true"), "fx must be a finite number, got True"),
    "fx null": (raw("fx", "null"), "fx must be a finite number, got None"),
    "width negative": (changed(width=-4), "width"),
    "width 0": (changed(width=0), "width"),
    "width fraction": (changed(width=4.5), "width must be a whole number"),
    "width 2 to the 31": (changed(width=2**31), "width"),
    "width 2 to the 64": (changed(width=2**64), "width"),
    "size 2 to the 31 squared": (changed(width=2**31 - 1, height=2**31 - 1), "width|pixels"),
    "model unknown": (changed(model="fisheye"), "model must be"),
    "model a list": (changed(model=["pinhole"]), "model must be"),
    "depth of another kind": (changed(depth="disparity"), "depth"),
    "depth a number": (changed(depth=5), "depth"),
    "distortion of four": (changed(distortion=[0, 0, 0, 0]), "distortion must be a list of 5 numbers"),
    "distortion of words": (changed(distortion=["a"] * 5), "distortion must be a finite number"),
    "distortion of 100000": (changed(distortion=[0] * 9_000), "distortion must be a list of 5 numbers"),
    "distortion huge": (changed(distortion=[1e300, 0, 0, 0, 0]), "distortion|lens"),
    "depth_scale 0": (changed(depth_scale=0), "depth_scale must be positive"),
    "depth_scale negative": (changed(depth_scale=-1000), "depth_scale must be positive"),
    "depth_scale infinite": (raw("depth_scale", "Infinity"), "depth_scale must be a finite number"),
    "orthographic without pixel_size": (changed(model="orthographic"), "the key 'pixel_size' is missing"),
    "orthographic of pixel_size 0": (changed(model="orthographic", pixel_size=0), "pixel_size"),
    "open3d by rows": (
        json.dumps({**OPEN3D, "intrinsic_matrix": [5, 0, 1.5, 0, 5, 1, 0, 0, 1]}),
        "column by",
    ),
    "open3d of 8 numbers": (json.dumps({**OPEN3D, "intrinsic_matrix": [0] * 8}), "a list of 9 numbers"),
    "open3d with skew": (
        json.dumps({**OPEN3D, "intrinsic_matrix": [5, 0, 0, 1, 5, 0, 1, 1, 1]}),
        "without skew",
    ),
    "a megabyte of lists": ("[" + "{}," * 300_000 + "{}]", "larger than"),
    "a megabyte of blanks": (" " * 1_000_000 + changed(), "larger than"),
}
BYTES = {
    "utf-16": (changed().encode("utf-16"), "not text"),
    "utf-8 with a mark": (b"\xef\xbb\xbf" + changed().encode(), "not a JSON file"),
    "latin-1": (changed(note="gr").encode().replace(b"gr", b"gr\xfc\xdf"), "not text"),
}
CAMERAS = single("camera", "camera", ".json", TEXTS | BYTES)
