"""What the page reads, by name: a document, and for each state of a model its points and triangles."""

from __future__ import annotations

import json
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.errors import FileFormatError
from nacre.io.quantization import quantized
from nacre.meshing import triangulate
from nacre.parameters import DepthParameters
from nacre.pictures.colormap import viridis
from nacre.pictures.image_files import encode_png
from nacre.run_data.reported_frame import plain_reason
from nacre.viewer.camera_path import make_path
from nacre.viewer.colors import STATUS_COLORS
from nacre.viewer.depth_picture import depth_legend, depth_picture
from nacre.viewer.disks import deviation
from nacre.viewer.holes import find_holes
from nacre.viewer.levels import Levels, pack_node, pack_tree
from nacre.viewer.packing import morton_order, pack, rounded
from nacre.viewer.point_columns import point_columns
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.snapshot_levels import SnapshotLevels
from nacre.viewer.timeline import CAMERA_FRAME, Timeline, words
from nacre.viewer.views import first_seen, first_view

MAX_POINTS, MAX_VERTICES = 1_000_000, 4_000_000
"""At once: of points alone, and of a mesh, of which fewer would leave no triangle."""
COARSE_POINTS = 50_000
"""Of a first picture, while the points are divided among nodes."""


class State(NamedTuple):
    """A state of a run's model: of the run ``run``, after the frame at ``place``."""

    run: int
    place: int
    cloud: Snapshot

    @property
    def name(self) -> str:
        """Of the state; another one has another name."""
        return f"{self.run}/{self.place}/{len(self.cloud.points)}"

    @property
    def is_mesh(self) -> bool:
        """Whether its triangles came with the points."""
        return self.cloud.triangles is not None

    @property
    def has_holes(self) -> bool:
        """Whether they are looked for: in points that are joined here, and stay where they are."""
        return not self.is_mesh and self.cloud.motion is None

    @property
    def shown(self) -> Snapshot:
        """The points that the page gets: not too many."""
        return self.cloud.thinned(MAX_VERTICES if self.is_mesh else MAX_POINTS)


def kept_points(timeline: Timeline) -> int:
    """Return how many points of the newest state a page without a server has."""
    return len(State(0, *timeline.snapshots[-1]).shown.points) if timeline.snapshots else 0


class PageData:
    """
    What the page shows of one run, or of two that are compared, as they are now.

    Parameters
    ----------
    timelines : sequence of Timeline
        One or two.
    parameters : DepthParameters, optional
        What is marked as removed in depth images.
    is_live : bool
        Whether a camera runs.

    Raises
    ------
    ValueError
        When there is nothing to compare with.
    """

    def __init__(
        self,
        timelines: Sequence[Timeline],
        parameters: DepthParameters | None = None,
        *,
        is_live: bool = False,
    ) -> None:
        if not all(other.has_points for other in timelines[1:]):
            raise ValueError("other must hold a state of the model to compare with, got none")
        self._timelines = timelines
        self._parameters = parameters
        self._is_live = is_live
        # Of a run alone: what bends is compared in its canonical shape.
        self._states = [
            State(run, place, cloud if len(timelines) == 1 else replace(cloud, motion=None))
            for run, timeline in enumerate(timelines)
            for place, cloud in timeline.snapshots
        ]
        # Of a run alone: two are compared by their points.
        painted = timelines[0].painted if len(timelines) == 1 else None
        self._painted = [] if painted is None else [State(0, len(timelines[0].frames), painted)]
        self.document = json.dumps(self._described(), allow_nan=False).encode()
        self._last: tuple[State, Snapshot] | None = None
        self._last_triangles: tuple[State, npt.NDArray[np.int32]] | None = None
        self._built: Levels | None = None
        self._building = threading.Lock()

    def prepare(self) -> None:
        """Begin to divide what is streamed among the nodes of an octree."""
        streamed = self._streamed
        if streamed is not None and self._timelines[0].levels is None:
            threading.Thread(target=self._levels_of, args=(streamed,), daemon=True).start()

    @property
    def names(self) -> list[str]:
        """Of all that a page without a server needs, but triangles."""
        return ["document", *(f"points/{state.name}" for state in self._states)]

    @property
    def surface_names(self) -> list[str]:
        """Of triangles, images and holes: of the newest state of each run, and of its painted mesh."""
        newest = {state.run: state for state in self._states}.values()
        triangles = [f"triangles/{state.name}" for state in newest]
        for state in self._painted:
            triangles += [f"{kind}/{state.name}" for kind in ("points", "triangles")]
        triangles += [f"image/{s.name}" for s in (*newest, *self._painted) if s.shown.painting is not None]
        return triangles + [f"holes/{state.name}" for state in newest if state.has_holes]

    def read(self, name: str) -> bytes:
        """
        Return the bytes that a name stands for.

        Raises
        ------
        KeyError
            When there are none.
        """
        if name == "document":
            return self.document
        kind, _, rest = name.partition("/")
        if kind == "depth":
            return self._depth(rest)
        if kind in ("tree", "node", "coarse"):
            return self._detail(kind, rest)
        if kind not in ("points", "triangles", "holes", "image"):
            raise KeyError(name)
        state = {state.name: state for state in (*self._states, *self._painted)}[rest]
        if kind == "image":
            return self._image(state)
        if kind == "holes" and not state.has_holes:
            raise KeyError(name)
        if kind == "triangles":
            return pack({}, {"triangles": _sorted_triangles(self._triangulated(state))})
        return self._holes(state) if kind == "holes" else self._points(state)

    @property
    def _streamed(self) -> State | None:
        """
        The state whose points the page reads node by node: too many to be read at once.

        The newest of a run alone that has ended; not a mesh, and not what bends.
        """
        timeline = self._timelines[0]
        if len(self._timelines) > 1 or timeline.is_growing or self._is_live or not self._states:
            return None
        newest = self._states[-1]
        if timeline.levels is not None:
            return newest
        is_whole = newest.is_mesh or newest.cloud.motion is not None
        return None if is_whole or len(newest.cloud.points) <= MAX_POINTS else newest

    def _detail(self, kind: str, rest: str) -> bytes:
        """Return what nodes the streamed state has, the points of one, or a few while these are not there."""
        name, _, node = rest.rpartition("/") if kind == "node" else (rest, "", "")
        streamed = self._streamed
        if streamed is None or name != streamed.name:
            raise KeyError(rest)
        if kind == "coarse":
            return self._packed(streamed, _ordered(streamed.cloud.thinned(COARSE_POINTS)))
        levels = self._levels_of(streamed)
        return pack_tree(levels) if kind == "tree" else pack_node(levels, node)

    def _levels_of(self, state: State) -> Levels:
        levels = self._timelines[0].levels
        if levels is not None:
            return levels
        with self._building:
            self._built = self._built or SnapshotLevels(state.cloud)
        return self._built

    def _described(self) -> dict[str, Any]:
        newest = {state.run: state for state in self._states}
        first, view = self._timelines[0], None
        if 0 in newest and len(newest[0].cloud.points):
            view = first_view(newest[0].cloud, first, newest[0].place).as_dict()
        return {
            "title": " and ".join(timeline.title for timeline in self._timelines),
            "isLive": self._is_live,
            "view": view,
            "comment": "metres" if first.is_upright or first.is_survey else f"metres; {CAMERA_FRAME}",
            "statusColors": STATUS_COLORS,
            "colormap": viridis(np.linspace(0, 1, 9)).tolist(),
            "depthLegend": depth_legend(),
            "runs": [self._described_run(run) for run in range(len(self._timelines))],
        }

    def _described_run(self, run: int) -> dict[str, Any]:
        timeline = self._timelines[run]
        frames = [
            {
                "index": frame.index,
                "status": frame.status,
                "reason": plain_reason(frame.reason),
                "details": frame.reason,
                "figures": words(frame),
                "pose": _rounded_pose(frame.world_from_camera),
                "truth": _rounded_pose(frame.truth),
            }
            for frame in timeline.frames
        ]
        streamed = self._streamed
        states: list[dict[str, Any]] = [
            {"name": s.name, "place": s.place, "total": len(s.cloud.points), "isStreamed": s is streamed}
            for s in self._states
            if s.run == run
        ]
        if states:
            states[-1]["total"] = timeline.num_points  # of which the page may get fewer
        return {
            "title": timeline.title,
            "placement": timeline.placement,
            "origin": timeline.origin.tolist(),
            "isMesh": any(s.is_mesh for s in self._states if s.run == run),
            "hasDepth": timeline.depth_of is not None and timeline.camera is not None,
            "hasPath": make_path(timeline.frames),
            "frustum": frustum_corners(timeline.camera).tolist(),
            "frames": frames,
            "states": states,
            "painted": next((state.name for state in self._painted if state.run == run), None),
        }

    def _prepared(self, state: State) -> Snapshot:
        """Return the points as the page gets them: not too many, neighbors in space near in order."""
        last = self._last
        if last is not None and last[0] is state:
            return last[1]
        ordered = _ordered(state.shown)
        self._last = state, ordered
        return ordered

    def _triangulated(self, state: State) -> npt.NDArray[np.int32]:
        """Return the triangles of the points as the page gets them."""
        last = self._last_triangles
        if last is not None and last[0] is state:
            return last[1]
        cloud = self._prepared(state)
        triangles = cloud.triangles
        if triangles is None:
            triangles = triangulate(cloud.points, cloud.normals, num_threads=1 if self._is_live else 0)
        self._last_triangles = state, triangles
        return triangles

    def _holes(self, state: State) -> bytes:
        timeline, corners = self._timelines[state.run], self._triangulated(state)
        found = find_holes(self._prepared(state), corners, timeline, state.place)
        return pack({"sizes": found.sizes}, {"segments": found.segments, "isHole": found.is_hole})

    def _points(self, state: State) -> bytes:
        return self._packed(state, self._prepared(state))

    def _packed(self, state: State, cloud: Snapshot) -> bytes:
        timeline = self._timelines[state.run]
        rows, origin, step = quantized(cloud.points)
        columns: dict[str, npt.NDArray[Any]] = {"points": rows, **point_columns(cloud)}
        header: dict[str, Any] = {"spacing": cloud.spacing, "origin": origin, "step": step}
        if cloud.painting is not None:
            columns["uv"], header["uvOrigin"], header["uvStep"] = quantized(cloud.painting.uv, 1e-9)
        if len(timeline.snapshots) == 1 and not state.is_mesh:
            first = first_seen(cloud, timeline, state.place)
            columns |= {} if first is None else {"firstSeen": first}
        if cloud.motion is not None:
            motion = cloud.motion
            # A point's places one after the other, which differ by little.
            columns["shapes"] = motion.points.transpose(1, 0, 2).reshape(-1, 3)
            columns["shapeNormals"] = motion.normals.transpose(1, 0, 2).reshape(-1, 2)
            moments = motion.moments.round(4).tolist()
            header["motion"] = {"origin": motion.origin.tolist(), "step": motion.step, "moments": moments}
        if len(self._timelines) == 2:
            other = self._timelines[1 - state.run].snapshots[-1][1]
            columns["deviation"] = rounded(deviation(cloud, other))
        return pack(header, columns)

    def _image(self, state: State) -> bytes:
        """Return the file of the image that is painted on a state."""
        painting = self._prepared(state).painting
        if painting is None:
            raise KeyError(state.name)
        return painting.image

    def _depth(self, place: str) -> bytes:
        """Return the depth image, with what was removed, of the first run's frame at a place."""
        timeline = self._timelines[0]
        if timeline.depth_of is None or timeline.camera is None or not place.isdecimal():
            raise KeyError(place)
        try:
            depth = timeline.depth_of(timeline.frames[int(place)].index)
        except (IndexError, FileFormatError, OSError) as error:
            raise KeyError(place) from error
        return encode_png(depth_picture(depth, timeline.camera, self._parameters))


def frustum_corners(camera: Camera | None) -> npt.NDArray[np.float64]:
    """Return the corners of the image, seen from the camera, on a plane at distance 1; (4, 3)."""
    x, y = 0.5, 0.375
    if camera is not None:
        focal = (camera.fx, camera.fy) if camera.model == "pinhole" else (camera.width, camera.width)
        x, y = camera.width / (2 * focal[0]), camera.height / (2 * focal[1])
    return np.array([(-x, -y, 1), (x, -y, 1), (x, y, 1), (-x, y, 1)], dtype=np.float64)


def _ordered(cloud: Snapshot) -> Snapshot:
    """Return the points so that neighbors in space are near in order."""
    rows, _, _ = quantized(cloud.points)
    return cloud.rows(morton_order(rows), cloud.spacing)


def _rounded_pose(pose: npt.NDArray[np.float64] | None) -> list[list[float]] | None:
    return None if pose is None else np.asarray(pose)[:3].round(6).tolist()


def _sorted_triangles(triangles: npt.NDArray[np.int32]) -> npt.NDArray[np.uint32]:
    """Return the same triangles, each from its first row on, in the order of these rows."""
    start = triangles.argmin(axis=1)[:, None] if len(triangles) else np.zeros((0, 1), np.int64)
    turned = np.take_along_axis(triangles, (start + np.arange(3)) % 3, axis=1)
    return np.asarray(turned[np.argsort(turned[:, 0], kind="stable")], np.uint32)
