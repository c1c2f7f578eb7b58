"""Points with all that belongs to them as records of one fixed size, which lie on disk as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.io.cloud import Cloud

Rows = npt.NDArray[Any]
"""(N,) records with the fields ``points``, ``normals``, ``colors``, and ``attribute NAME`` of each other."""

_ATTRIBUTE = "attribute "


def row_type(cloud: Cloud, leave_out: frozenset[str] = frozenset()) -> np.dtype[Any]:
    """Return the type of a cloud's rows, without attributes that are no numbers, and those to leave out."""
    fields: list[tuple[str, Any, tuple[int, ...]]] = [("points", cloud.points.dtype, (3,))]
    if cloud.normals is not None:
        fields.append(("normals", cloud.normals.dtype, (3,)))
    if cloud.colors is not None:
        fields.append(("colors", np.dtype(np.uint8), (3,)))
    fields += [
        (_ATTRIBUTE + name, values.dtype, values.shape[1:])
        for name, values in cloud.attributes.items()
        if values.dtype.kind in "buif" and name not in leave_out
    ]
    return np.dtype(fields)


def to_rows(cloud: Cloud, dtype: np.dtype[Any]) -> Rows:
    """Return a cloud as records of this type, where points are all that they have as a view."""
    if _names(dtype) == ("points",):
        return np.ascontiguousarray(cloud.points).reshape(-1).view(dtype)
    rows = np.empty(len(cloud), dtype)
    for name in _names(dtype):
        is_attribute = name.startswith(_ATTRIBUTE)
        rows[name] = cloud.attributes[name[len(_ATTRIBUTE) :]] if is_attribute else getattr(cloud, name)
    return rows


def to_cloud(rows: Rows) -> Cloud:
    """Return records as a cloud of views."""
    columns = {name: rows[name] for name in _names(rows.dtype)}
    attributes = {
        name[len(_ATTRIBUTE) :]: values for name, values in columns.items() if name.startswith(_ATTRIBUTE)
    }
    return Cloud(columns["points"], columns.get("normals"), columns.get("colors"), attributes)


def with_normals(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return a type of rows that has normals in float32."""
    others = [(name, dtype[name]) for name in _names(dtype) if name not in ("points", "normals")]
    return np.dtype([("points", dtype["points"]), ("normals", np.float32, (3,)), *others])


def finite_among(rows: Rows, points: npt.NDArray[Any]) -> Rows:
    """Return the rows whose points are finite: mostly all of them, as they are."""
    is_finite = np.isfinite(points)
    return rows if is_finite.all() else rows[is_finite.all(axis=1)]


def take(rows: Rows, order: npt.NDArray[np.intp]) -> Rows:
    """Return rows in this order; as plain bytes, for NumPy takes records field by field."""
    plain = np.ascontiguousarray(rows).view(f"V{rows.dtype.itemsize}")
    taken: Rows = plain.take(order).view(rows.dtype)
    return taken


def copy_fields(source: Rows, target: Rows, but: tuple[str, ...] = ()) -> None:
    """Copy what both have, but for some fields."""
    for name in set(_names(source.dtype)) & set(_names(target.dtype)) - set(but):
        target[name] = source[name]


def _names(dtype: np.dtype[Any]) -> tuple[str, ...]:
    assert dtype.names is not None
    return dtype.names
