"""Nodes of a COPC file, read one by one."""

from __future__ import annotations

import os
import struct
import threading
import weakref
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io import las
from nacre.io.cloud import Cloud
from nacre.io.copc import ENTRY
from nacre.io.octree import Key
from nacre.io.raw import require_regular

_MOST_NODES = 1_000_000
_MOST_NODE_BYTES = 1 << 28  # uncompressed
_DEEPEST = 30  # coordinates of keys are 32-bit
_LAYERS = {6: 9, 7: 10, 8: 11}  # of compressed points, by their format; and one for each extra byte
_ENTRIES = np.dtype([("key", "<i4", 4), ("place", "<u8"), ("bytes", "<i4"), ("points", "<i4")])


class _Chunk(NamedTuple):
    """Where the compressed points of a node are in the file."""

    place: int
    num_bytes: int
    num_points: int


class CopcFile:
    """
    A COPC file that is open; of its points it has none in memory. Use as a context manager, or close it.

    Parameters
    ----------
    path : path-like
    fields : tuple of str
        What else a node's points come with, beside colours and normals, where the file has it.

    Attributes
    ----------
    corner : (3,) float64
        The lowest of the root.
    side, spacing : float
        Of the root, and between its points, as the file says; each level below has half of both.
    counts : dict of Key to int
        The points of each node.
    comments : tuple of str
        What the file says of its content, line by line.

    Raises
    ------
    FileFormatError
        When the file is no COPC, or its hierarchy is damaged: before memory is spent on it.
    OSError, ImportError
        When it cannot be read, or laspy and lazrs are missing.
    """

    def __init__(self, path: str | os.PathLike[str], fields: tuple[str, ...] = ()) -> None:
        self.path = Path(path)
        laspy = las.import_laspy()
        self._lock = threading.Lock()
        self._stream = require_regular(path).open("rb")
        self._closing = weakref.finalize(self, self._stream.close)  # as this goes, where nobody closes it
        try:
            self._status = self._state()
            self._size = self._status[0]
            las.check_header(path, self._stream, self._size)
            self._stream.seek(0)
            with las.readable(path):
                self._header = laspy.LasHeader.read_from(self._stream)
            self.comments = las.comments_of(self._header)
            self._names = self._wanted(fields)
            self._laszip = self._laszip_record()
            info = next(iter(self._header.vlrs.get("CopcInfoVlr")), None)
            if info is None:
                raise FileFormatError(path, "not a COPC file: its first record does not describe an octree")
            self.side, self.spacing = 2 * float(info.halfsize), float(info.spacing)
            self.corner: npt.NDArray[np.float64] = np.asarray(info.center, np.float64) - info.halfsize
            self._check_root()
            self._chunks = self._hierarchy(int(info.hierarchy_root_offset), int(info.hierarchy_root_size))
            self.counts: dict[Key, int] = {key: chunk.num_points for key, chunk in self._chunks.items()}
            self._check_counts()
            self._is_wide = False
            self._is_wide = self._has_wide_colors()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> CopcFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._closing()

    def read(self, key: Key) -> Cloud:
        """
        Return the points of a node, with coordinates in float64.

        Raises
        ------
        KeyError
            When there is no such node.
        FileFormatError, OSError
            When its points are damaged, or the file is not what it was when it was opened.
        """
        return las.cloud_of(self.path, [self._records(key)], self._names, self._is_wide, keep_all=True)

    def _records(self, key: Key) -> Any:
        import laspy
        import lazrs

        place, num_bytes, num_points = self._chunks[key]
        header = self._header
        points = np.zeros(num_points, header.point_format.dtype())
        if num_points:
            with self._lock:
                if self._state() != self._status:
                    raise FileFormatError(self.path, "it was changed while it was read")
                self._stream.seek(place)
                compressed = self._stream.read(num_bytes)
            self._check_layers(compressed, num_points, place)
            table = [(num_points, num_bytes)]
            with las.readable(self.path):
                lazrs.decompress_points_with_chunk_table(
                    compressed, self._laszip, points.view(np.uint8), table
                )
        return laspy.ScaleAwarePointRecord(points, header.point_format, header.scales, header.offsets)

    def _state(self) -> tuple[int, int]:
        status = os.fstat(self._stream.fileno())
        return status.st_size, status.st_mtime_ns

    def _wanted(self, fields: tuple[str, ...]) -> list[str]:
        names = set(self._header.point_format.dimension_names)
        return [name for name in ("X", "Y", "Z", *las.NORMALS, *las.COLORS, *fields) if name in names]

    def _laszip_record(self) -> Any:
        import lazrs

        header = self._header
        point_format = header.point_format.id
        if point_format not in _LAYERS:
            raise FileFormatError(self.path, f"a COPC file has point format 6, 7 or 8, got {point_format}")
        record = next(iter(header.vlrs.get("LasZipVlr")), None)
        if record is None:
            raise FileFormatError(self.path, "a COPC file has a record of its compression, got none")
        with las.readable(self.path):
            size = lazrs.LazVlr(record.record_data).item_size()
        if size != header.point_format.size:
            reason = f"points of {header.point_format.size} bytes are compressed as such of {size}"
            raise FileFormatError(self.path, reason)
        return record.record_data

    def _check_root(self) -> None:
        finite = np.isfinite([*self.corner, self.side, self.spacing]).all()
        if not (finite and self.side > 0 and self.spacing > 0):
            reason = f"an octree has a side and a spacing, got {self.side} and {self.spacing}"
            raise FileFormatError(self.path, reason, offset=375)

    def _hierarchy(self, place: int, num_bytes: int) -> dict[Key, _Chunk]:
        """Read every page of the hierarchy; each but once."""
        chunks: dict[Key, _Chunk] = {}
        pages, seen = [(place, num_bytes)], set()
        while pages:
            place, num_bytes = pages.pop()
            if place in seen:
                raise FileFormatError(self.path, "a page of the hierarchy is named twice", offset=place)
            seen.add(place)
            for key, chunk in self._page(place, num_bytes):
                if chunk.num_points == -1:
                    pages.append(chunk[:2])
                elif key in chunks:
                    raise FileFormatError(self.path, f"node {key} is named twice", offset=place)
                else:
                    chunks[key] = chunk
            if len(chunks) + len(pages) > _MOST_NODES:
                raise FileFormatError(self.path, f"the hierarchy has more than {_MOST_NODES} nodes")
        return chunks

    def _page(self, place: int, num_bytes: int) -> list[tuple[Key, _Chunk]]:
        """Return the entries of a page, none of which promises what the file cannot hold."""
        if num_bytes % ENTRY.size or not 0 <= num_bytes <= self._size - place:
            reason = f"a page of the hierarchy has {num_bytes} bytes of a file of {self._size}"
            raise FileFormatError(self.path, reason, offset=place)
        if num_bytes > _MOST_NODES * ENTRY.size:
            raise FileFormatError(self.path, f"the hierarchy has more than {_MOST_NODES} nodes")
        self._stream.seek(place)
        entries = np.frombuffer(self._stream.read(num_bytes), _ENTRIES)
        level, counts = entries["key"][:, 0], entries["points"]
        inside = (level >= 0) & (level <= _DEEPEST)
        sides = np.left_shift(1, np.clip(level, 0, _DEEPEST).astype(np.int64))[:, None]
        inside &= ((entries["key"][:, 1:] >= 0) & (entries["key"][:, 1:] < sides)).all(axis=1)
        fits = entries["place"] <= self._size
        fits &= np.minimum(entries["place"], self._size).astype(np.int64) + entries["bytes"] <= self._size
        most = _MOST_NODE_BYTES // self._header.point_format.size
        sane = inside & (counts >= -1) & (counts <= most) & ((counts == 0) | (fits & (entries["bytes"] > 0)))
        if not sane.all():
            wrong = int(np.argmin(sane))
            reason = f"the hierarchy promises what cannot be: {entries[wrong].item()}"
            raise FileFormatError(self.path, reason, offset=place + wrong * ENTRY.size)
        rows = zip(
            map(tuple, entries["key"].tolist()),
            entries["place"].tolist(),
            entries["bytes"].tolist(),
            counts.tolist(),
            strict=True,
        )
        return [(key, _Chunk(*chunk)) for key, *chunk in rows]

    def _check_counts(self) -> None:
        found, promised = sum(self.counts.values()), self._header.point_count
        if found != promised:
            reason = f"the header promises {promised} points, the hierarchy {found}"
            raise FileFormatError(self.path, reason, offset=247)

    def _check_layers(self, compressed: bytes, num_points: int, place: int) -> None:
        """Refuse a chunk that lacks bytes, or whose layers promise more: lazrs would ask memory for them."""
        point_format = self._header.point_format
        num_layers = _LAYERS[point_format.id] + point_format.num_extra_bytes
        start = point_format.size + 4 + 4 * num_layers
        if len(compressed) >= start:
            found, *layers = struct.unpack_from(f"<I{num_layers}I", compressed, point_format.size)
            if found == num_points and start + sum(layers) <= len(compressed):
                return
        reason = f"{num_points} compressed points are promised that are not there"
        raise FileFormatError(self.path, reason, offset=place)

    def _has_wide_colors(self) -> bool:
        """Say whether colours fill 16 bits, by those of the first node that has points."""
        first = next((key for key in sorted(self.counts) if self.counts[key]), None)
        return first is not None and las.has_wide_colors(self._records(first))
