"""Checkpoints: files from which a model, or a run, goes on."""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nacre import _core
from nacre._internal.arrays import as_scale
from nacre._internal.guided import GuidedNames, guided
from nacre.errors import FileFormatError

POINTS_AND_MESHES = frozenset([
    ".ply", ".pcd", ".las", ".laz", ".e57", ".xyz", ".npz", ".glb", ".obj", ".off", ".stl",
])  # fmt: skip
"""What their files end in: not asked of ``nacre.io``, as the handler of a signal may save amid an import."""


class Checkpointed(GuidedNames, ABC):
    """What can be written to a file between any two frames, and goes on from there to the same bits."""

    @guided()
    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write all that is known to a file, so that ``load`` can go on with it.

        It may be called between any two frames, also while a run tries lost ones again. What was saved and
        loaded goes on to the same bits as what was not. The file is complete or not there at all. It is for
        going on, on any machine, with any nacre of the same checkpoint format (its changes are in the change
        log); what is to be kept for years is written with :func:`nacre.write_points`.

        Parameters
        ----------
        path : path-like
            The file; its folder must exist.

        Raises
        ------
        ValueError
            The file is named like one of points or a mesh, which it would not be.
        OSError
            The file cannot be written; what was there before is left as it was.
        """
        ending = Path(path).suffix.lower()
        if ending in POINTS_AND_MESHES:
            raise ValueError(
                f"path must not end in {ending}, got {os.fspath(path)!r}: what is saved is to go on from; "
                "nacre.write_points(path, model) and nacre.write_mesh(path, model.to_mesh()) write the model"
            )
        self._save(path)

    def _save(self, path: str | os.PathLike[str], **more: Any) -> None:
        from nacre.io.atomic import atomic_writer

        data = self._checkpoint(**more)
        with atomic_writer(path) as stream:
            stream.write(data)

    @abstractmethod
    def _checkpoint(self, **more: Any) -> bytes:
        """Return the file's bytes, with more plain values of the caller's."""


def checkpoint_of(core: _core.Model, depth_scale: float, more: Mapping[str, Any]) -> bytes:
    """Return a model as bytes, with what Python knows beside it."""
    return core.save(json.dumps({"depth_scale": depth_scale, **more}))


def file_name(path: str | os.PathLike[str] | None) -> bytes:
    """Return the whole name of a file, as the system has it, for C++; nothing for None."""
    return b"" if path is None else os.fsencode(os.path.abspath(path))  # noqa: PTH100


def read_checkpoint(
    path: str | os.PathLike[str], points_folder: str | os.PathLike[str] | None = None
) -> tuple[_core.Model, float, dict[str, Any]]:
    """Return the model, the scale of its depth images, and the rest of what was written beside it."""
    from nacre.io.raw import read_file

    data = read_file(path)
    try:
        core, note = _core.Model.load(data, file_name(points_folder))
    except _core.CheckpointError as error:
        reason, offset = error.args
        raise FileFormatError(path, reason, offset=offset) from None
    try:
        more = json.loads(note)
        written = more.pop("depth_scale")
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise FileFormatError(path, "it was saved by C++: it does not say the depth_scale") from None
    try:
        return core, as_scale("depth_scale", written), more
    except (TypeError, ValueError) as error:
        raise FileFormatError(path, str(error)) from None
