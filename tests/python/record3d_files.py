"""Record3D recordings, packed as the app packs them."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Image = pytest.importorskip("PIL.Image")
liblzfse = pytest.importorskip("liblzfse")

WIDTH, HEIGHT, FRAMES = 192, 256, 3
METADATA: dict[str, Any] = {
    "w": 720, "h": 960, "dw": WIDTH, "dh": HEIGHT, "fps": 30, "cameraType": 1,
    "K": [700.0, 0, 0, 0, 701.0, 0, 359.5, 479.5, 1],
    "frameTimestamps": [5.0 + i / 30 for i in range(FRAMES)],
    "poses": [[0, 0, 0, 1, 0.1 * i, 0.2, 0.3] for i in range(FRAMES)],
}  # fmt: skip


def depth_image(i: int) -> np.ndarray:
    image = np.full((HEIGHT, WIDTH), 1.5 + 0.01 * i, np.float32)
    image[0] = np.nan
    image[1] = 0
    return image


def jpeg(i: int) -> bytes:
    image = np.zeros((960, 720, 3), np.uint8)
    image[:, :360, 0], image[:, 360:, 1] = 200, 40 * i
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, format="JPEG", quality=95)
    return stream.getvalue()


def contents(**metadata: Any) -> dict[str, bytes]:
    files = {"icon": jpeg(0), "sound.m4a": b"not read"}
    for i in range(FRAMES):
        confidence = np.full((HEIGHT, WIDTH), 2, np.uint8)
        confidence[:, :10], confidence[:, 10:20] = 0, 1
        files[f"rgbd/{i}.depth"] = liblzfse.compress(depth_image(i).tobytes())
        files[f"rgbd/{i}.conf"] = liblzfse.compress(confidence.tobytes())
        files[f"rgbd/{i}.jpg"] = jpeg(i)
    told = {key: value for key, value in (METADATA | metadata).items() if value is not None}
    return files | {"metadata": json.dumps(told).encode()}


def packed(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def unpacked(folder: Path, files: dict[str, bytes]) -> Path:
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    return folder
