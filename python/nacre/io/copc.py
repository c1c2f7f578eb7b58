"""Cloud Optimized Point Clouds: LAZ files whose points are in an octree, from coarse to fine."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from nacre.io.octree import CELLS_PER_SIDE, Cube, Key, Records, nodes

SUFFIX = ".copc.laz"

_INFO = struct.Struct("<5d2Q2d88x")  # centre, half side, spacing; hierarchy: place, bytes; times
ENTRY = struct.Struct("<4iQ2i")  # key, place, bytes, points
_EXTENDED_RECORD = struct.Struct("<2x16sHQ32s")
_NODES_AT_ONCE = 32  # which threads compress


def is_copc(path: str | os.PathLike[str]) -> bool:
    """Say whether a file is to be one, by its name."""
    return Path(path).name.lower().endswith(SUFFIX)


def write(
    stream: BinaryIO,
    header: Any,
    records: Iterable[Records],
    num_points: int,
    bounds: npt.NDArray[Any],
    folder: Path,
) -> None:
    """
    Write points to an empty file.

    Parameters
    ----------
    stream : file
        Open for reading and writing.
    header : laspy.LasHeader
        Of LAS 1.4, with the point format, steps and offsets.
    records : iterable of (N,) records
        In the header's format.
    num_points : int
        Of all records.
    bounds : (2, 3) array
        Between which all points lie.
    folder : Path
        Where points are kept meanwhile.

    References
    ----------
    "COPC specification 1.0", Hobu, Inc., 2021; "LAS specification 1.4", ASPRS, 2019.
    """
    import laspy
    import lazrs

    header.partial_reset()
    header.are_points_compressed = header.global_encoding.wkt = True
    laszip = lazrs.LazVlr.new_for_compression(
        header.point_format.id, header.point_format.num_extra_bytes, use_variable_size_chunks=True
    )
    info = laspy.VLR("copc", 1, "COPC info VLR", bytes(_INFO.size))
    header.vlrs.insert(0, info)
    header.vlrs.append(laspy.VLR("laszip encoded", 22204, "https://laszip.org", bytes(laszip.record_data())))
    header.write_to(stream)

    steps = (
        np.round((bounds - header.offsets) / header.scales).astype(np.int64)
        if num_points
        else np.zeros((2, 3))
    )
    cube = Cube.around(steps[0].astype(np.int64) - 1, steps[1].astype(np.int64) + 2)
    times = [np.inf, -np.inf]
    keys: list[Key] = []
    compressor = lazrs.ParLasZipCompressor(stream, laszip)
    compressor.reserve_offset_to_chunk_table()
    in_order = iter(nodes(records, cube, num_points, folder))
    while batch := list(islice(in_order, _NODES_AT_ONCE)):
        for key, points in batch:
            keys.append(key)
            header.grow(laspy.PackedPointRecord(points, header.point_format))
            times = [min(times[0], points["gps_time"].min()), max(times[1], points["gps_time"].max())]
        compressor.compress_chunks([points.view(np.uint8) for _, points in batch])
    compressor.done()

    end = stream.seek(0, os.SEEK_END)
    stream.seek(header.offset_to_point_data)
    table = lazrs.read_chunk_table(stream, laszip)
    entries = b"".join(_entries(keys, table, header.offset_to_point_data + 8))
    stream.seek(end)
    stream.write(_EXTENDED_RECORD.pack(b"copc", 1000, len(entries), b"EPT hierarchy"))
    stream.write(entries)

    half = 2.0 ** (cube.bits - 1) * header.scales[0]
    center = header.offsets + cube.origin * header.scales + half
    first = end + _EXTENDED_RECORD.size
    info.record_data = _INFO.pack(
        *center, half, 2 * half / CELLS_PER_SIDE, first, len(entries), *(times if keys else (0, 0))
    )
    header.number_of_evlrs, header.start_of_first_evlr = 1, end
    if not keys:
        header.mins, header.maxs = np.zeros(3), np.zeros(3)
    stream.seek(0)
    header.write_to(stream, ensure_same_size=True)


def _entries(keys: list[Key], table: list[tuple[int, int]], place: int) -> Iterator[bytes]:
    """Yield what the hierarchy says of each node, and of those above it that have no points."""
    told: set[Key] = set()
    for key, (num_points, num_bytes) in zip(keys, table, strict=True):
        told.add(key)
        yield ENTRY.pack(*key, place, num_bytes, num_points)
        place += num_bytes
    for key in keys:
        level, x, y, z = key
        while level > 0:
            level, x, y, z = level - 1, x >> 1, y >> 1, z >> 1
            if (level, x, y, z) in told:
                break
            told.add((level, x, y, z))
            yield ENTRY.pack(level, x, y, z, 0, 0, 0)
