"""The loop: depth frames in, a growing point model and a camera trajectory out."""

from __future__ import annotations

import logging
import numbers
import os
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import (
    as_attributes,
    as_camera,
    as_colors,
    as_count,
    as_depth,
    as_flag,
    as_levels,
    as_mask,
    as_number,
    as_pose,
    as_scale,
)
from nacre._internal.checkpoint import Checkpointed, checkpoint_of, file_name, read_checkpoint
from nacre._internal.core_options import from_core, mirrored, to_core, updated
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.camera import Camera, camera_of
from nacre.depth_calibration import DepthCalibration
from nacre.frame_report import FrameReport, FrameReports, report_from
from nacre.meshing.surface_points import surface_rows
from nacre.noise import NoiseModel
from nacre.parameters import (
    ModelParameters,
    Preset,
)
from nacre.point_exchange import ExchangeablePoints
from nacre.point_sigma import point_sigma

if TYPE_CHECKING:
    from nacre.io.cloud import Cloud

_log = logging.getLogger("nacre.model")


class Model(ExchangeablePoints, Checkpointed):
    """
    A 3D model that grows with every depth frame.

    The world is the first camera's frame, unless the first frame comes with a guess of its pose. Frames that
    cannot be registered change nothing. Where the first frame explains no other, three in a row that explain
    each other begin the model anew, and the world is the first of them.

    Parameters
    ----------
    camera : Camera
        Of all frames.
    preset : "default" or "paper"
        Where the parameters start from: what measures best, or the 2010 paper's algorithm and numbers, alone.
    parameters : ModelParameters, optional
        Takes the place of the preset.
    depth_scale : float
        Stored units per metre of the depth images that will come: 1 for metres, 1000 for millimetres, 5000
        for TUM.
    points_folder : path-like, optional
        Where points go, beyond ``max_points``, that the camera has left behind; they come back when it does.
        What older key frames saw goes there, too, and is read where a loop may close.
        Without it the spacing is widened at ``max_points``. The folder is made where it is needed, and the
        model's files in it go when they are needed no more. Used with ``loop_closure``, where
        ``fusion_method`` is "fuse" and without ``deform``.
    **changes
        Fields of :class:`ModelParameters` to change, such as ``spacing=0.002``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Notes
    -----
    After Blackburn, Kubacki and Stratton 2010, incremental 3D model generation with depth cameras.
    """

    @guided("nacre.Camera(width, height, fx, fy, cx, cy), or nacre.read_camera(path).camera")
    def __init__(
        self,
        camera: Camera,
        preset: Preset = "default",
        *,
        parameters: ModelParameters | None = None,
        depth_scale: float = 1.0,
        points_folder: str | os.PathLike[str] | None = None,
        **changes: Any,
    ) -> None:
        given = as_camera("camera", camera)
        if parameters is None:
            parameters = ModelParameters.preset(preset)
        as_kind("parameters", parameters, ModelParameters, "nacre.ModelParameters")
        parameters = updated(parameters, changes)
        self.parameters = replace(parameters, depth=parameters.depth.for_camera(camera))
        self._camera = given if isinstance(given, Camera) else camera_of(given)
        self._depth_scale = as_scale("depth_scale", depth_scale)
        options = to_core(self.parameters, _core.ModelOptions())
        self._core = _core.Model(camera, options, file_name(points_folder))
        self.parks_points = points_folder is not None
        self._whole: _core.PointModel | None = None  # while more than one thing is asked of all points
        self._calibration: tuple[int, DepthCalibration | None] | None = None  # by so many frames
        self._lock = threading.RLock()  # the handler of a signal may come into a call

    @guided(
        rgb="color",
        image="color",
        time="timestamp",
        pose="guess",
        world_from_camera="guess",
        extrinsic="guess takes its inverse, world_from_camera",
        depth_scale="it belongs to the model: nacre.Model(camera, depth_scale=...)",
        intrinsic="the model has its camera: nacre.Model(camera)",
    )
    def add_frame(
        self,
        depth: npt.ArrayLike,
        color: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
        timestamp: float | None = None,
        *,
        confidence: npt.ArrayLike | None = None,
        attributes: Mapping[str, npt.ArrayLike] | None = None,
        guess: npt.ArrayLike | None = None,
        keep_guess: bool = False,
        movable: bool = False,
        search: bool = True,
    ) -> FrameReport:
        """
        Clean a depth image, register it to the model and fuse it.

        Parameters
        ----------
        depth : (H, W) real
            Depth in the camera's kind, in units of 1 / ``depth_scale`` metres; 0, NaN, inf, negative values
            and 65535 of integer images are no measurement. Not copied if it is C-contiguous float32 in
            metres.
        color : (H, W, 3) integers from 0 to 255, or floats from 0 to 1, optional
            Red, green, blue of each pixel; fused along with the points.
        mask : (H, W), optional
            Pixels where it is 0 are not used.
        timestamp : float, optional
            [s], kept in the report.
        confidence : (H, W) integer or bool, optional
            How sure the camera is of each pixel, 0 to 255, in levels of its own. What each is worth the
            residuals of registered frames tell: pixels of less sure levels weigh less.
        attributes : mapping of str to (H, W) or (H, W, C) real, optional
            Anything else that pixels have (an intensity, a temperature, class probabilities), by name; NaN
            is no value. Fused along with the points, as colours are, where ``fusion_method`` is "fuse".
        guess : (4, 4), optional
            A pose (world_from_camera) to start the registration from, in place of the last one.
        keep_guess : bool
            Take the guess for the pose. What registration from there tells of the camera's noise is learned.
        movable : bool
            Whether loops that close may move a guess that is kept: where it is as good as the motion since
            the frame before. Without it the frame stays where it is given.
        search : bool
            Whether a frame that is lost near its guess is looked for elsewhere, too, where ``relocalise`` is
            on.

        Returns
        -------
        FrameReport
            Its ``status`` is "LOST" where the frame could not be registered; then the model is as it was
            before.

        Raises
        ------
        TypeError, ValueError
            Arrays of the wrong type or shape; a median depth outside 0.05-50 m (the depth scale cannot be
            right). Nothing is changed.
        OSError
            Where there is a ``points_folder``: nothing can be written there, and nothing is changed; or
            what was written cannot be read, or is damaged. Then the model takes no more frames, and
            :meth:`load` goes on from what was saved before.
        """
        image = as_depth("depth", depth, self._depth_scale)
        pixels = as_mask("mask", mask, image.shape)
        sure = as_levels("confidence", confidence, image.shape)
        colors = np.zeros((0, 3), np.uint8)
        if color is not None:
            colors = as_colors("color", color, (*image.shape, 3)).reshape(-1, 3)
        more = as_attributes("attributes", attributes, (image.shape[0], image.shape[1]))
        pose = None if guess is None else as_pose("guess", guess)
        if timestamp is not None and not isinstance(timestamp, numbers.Real):
            raise TypeError(f"timestamp must be a number of seconds or None, got {timestamp!r}")
        time = None if timestamp is None else as_number("timestamp", timestamp)
        flags = as_flag("keep_guess", keep_guess), as_flag("movable", movable), as_flag("search", search)
        with self._lock:
            before = self._core.tilt
            report = report_from(self._core.add_frame(image, pixels, sure, colors, more, time, pose, *flags))
            if self._core.tilt != before:
                _log.info(
                    "frame %d: depth is tilted by %.4f / m, and is corrected", report.index, self._core.tilt
                )
            return report

    def _checkpoint(self, **more: Any) -> bytes:
        with self._lock:
            return checkpoint_of(self._core, self._depth_scale, more)

    @classmethod
    @guided()
    def load(
        cls, path: str | os.PathLike[str], *, points_folder: str | os.PathLike[str] | None = None
    ) -> Model:
        """
        Read a model that :meth:`save` wrote.

        Parameters
        ----------
        path : path-like
            The file. It may come from anybody: nothing in it is run, and no more memory is taken than it
            fills.
        points_folder : path-like, optional
            Of a model that had one, where that is now. It keeps the files of its two newest saves.

        Returns
        -------
        Model

        Raises
        ------
        FileFormatError
            It is no saved model, it is damaged or not all there, or another version's; with the place.
        ValueError
            The model had a ``points_folder``, and none is given; or the other way round.
        OSError
            It cannot be read.
        """
        return cls._loaded(path, points_folder)[0]

    @classmethod
    def _loaded(
        cls, path: str | os.PathLike[str], points_folder: str | os.PathLike[str] | None
    ) -> tuple[Model, dict[str, Any]]:
        core, scale, more = read_checkpoint(path, points_folder)
        model = cls(
            camera_of(core.camera),
            parameters=from_core(ModelParameters, core.given_options),
            depth_scale=scale,
        )
        model._core = core
        model.parks_points = points_folder is not None
        return model, more

    def __len__(self) -> int:
        """Return the number of points."""
        with self._lock:
            return self._core.num_points

    @property
    def _points(self) -> _core.PointModel:
        """All points: those that left memory are read."""
        if self._core.num_points == len(self._core.cloud):
            return self._core.cloud
        return self._core.whole_cloud() if self._whole is None else self._whole

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(
            "a Model cannot be pickled or copied: write it with model.save and read it with Model.load, or "
            "pickle what it holds (model.points, model.normals, model.poses, model.frames, model.parameters)"
        )

    def __repr__(self) -> str:
        with self._lock:
            count = self._core.num_frames
            tracked = sum(self._core.report(i).status != "LOST" for i in range(count))
        frames = f"{tracked} of {count} frames tracked"
        return f"Model({len(self)} points, {frames}, spacing={self.spacing:.4g} m)"

    def recall_points(self) -> None:
        """
        Bring all points back to memory from ``points_folder``, until more frames are added.

        Raises
        ------
        OSError
            A file cannot be read, or is damaged; nothing is changed.
        """
        with self._lock:
            self._core.recall_all()

    @property
    def camera(self) -> Camera:
        """The camera of all frames."""
        return self._camera

    @property
    def points(self) -> npt.NDArray[np.float32]:
        """(N, 3) points in the world frame [m]; a copy. Those in ``points_folder``, too."""
        with self._lock:
            return self._points.points

    @property
    def normals(self) -> npt.NDArray[np.float32]:
        """(N, 3) unit normals towards the cameras that saw the points; a copy."""
        with self._lock:
            return self._points.normals

    @property
    def colors(self) -> npt.NDArray[np.uint8] | None:
        """(N, 3) colours, or None when no frame had any; a copy."""
        with self._lock:
            colors = self._points.colors
        if len(colors) == 0:
            return None
        return np.clip(np.rint(np.nan_to_num(colors)), 0, 255).astype(np.uint8)

    @property
    def attributes(self) -> dict[str, npt.NDArray[np.float32]]:
        """(N,) or (N, C) for each attribute that a frame had, by name; NaN where never seen; a copy."""
        with self._lock:
            attributes = self._points.attributes
        return {name: values[:, 0] if values.shape[1] == 1 else values for name, values in attributes.items()}

    @property
    def confidence(self) -> npt.NDArray[np.float32]:
        """(N,) frontal observations that each point stands for; a copy."""
        with self._lock:
            return self._points.confidence

    @property
    def point_sigma(self) -> npt.NDArray[np.float64]:
        """
        (N,) the expected standard deviation of each point across the surface [m].

        From the measured noise: what a point's observations average away of it (``confidence``), and what
        registered frames showed beyond it (``noise_factor``), which is taken for the same in all of them.
        Errors of the poses, and shape that is finer than the pixels, come on top. NaN where
        ``fusion_method`` is not "fuse", and, unless the noise is given (``depth.noise``), as long as every
        frame's pose was given, or was found by the search for an object that turned on its plane: nobody
        knows how far those are off.
        """
        with self._lock:
            return point_sigma(self)

    @property
    def last_seen(self) -> npt.NDArray[np.int32]:
        """(N,) the index of the last frame that observed each point; a copy."""
        with self._lock:
            return self._points.last_seen

    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """
        (F, 4, 4) world_from_camera of every frame; NaN where the frame is lost.

        Where a later frame corrected them, as they are known since.
        """
        with self._lock:
            poses = np.full((self._core.num_frames, 4, 4), np.nan)
            for index, pose in enumerate(poses):
                report = self._core.report(index)
                if report.status != "LOST":
                    pose[:] = report.world_from_camera
        return poses

    @property
    def frames(self) -> Sequence[FrameReport]:
        """
        The reports of the frames that were added so far, as corrected by later frames.

        Each is made when it is asked for, since the model keeps of a frame only the few bytes that tell it.
        """
        with self._lock:
            return FrameReports(self._core, self._lock, self._core.num_frames)

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points [m]; 0 before the first frame."""
        with self._lock:
            return self._core.spacing

    @property
    def binning(self) -> int:
        """The side of the blocks of pixels that are averaged: given, or decided by the first frame."""
        with self._lock:
            return self._core.binning

    @property
    def depth_calibration(self) -> DepthCalibration | None:
        """
        What views in different directions say of systematic errors of the depth, as it comes.

        They are corrected where they are significant, at every sixth view in a new direction. None where that
        is not asked for (``calibrate_depth``), or cannot be: for a region, or a camera whose depth is not
        along the axis of a pinhole. To find them takes some tenths of a second.
        """
        with self._lock:
            num_frames = self._core.num_frames
            if self._calibration is None or self._calibration[0] != num_frames:
                found = self._core.depth_calibration
                known = None if found is None else mirrored(DepthCalibration, found)
                self._calibration = num_frames, known
            return self._calibration[1]

    @property
    def corrects_depth(self) -> bool:
        """Whether a systematic error of the depth was found, and is corrected."""
        with self._lock:
            return self._core.tilt != self.parameters.depth.tilt

    @property
    def noise(self) -> NoiseModel:
        """The noise of the depth: as given, or measured from the images so far."""
        with self._lock:
            return mirrored(NoiseModel, self._core.noise)

    @property
    def depth_unit(self) -> float:
        """
        The step that depth comes in [m]; 0 where noise hides it.

        What is flat within a step cannot be told from what is not: poses and surfaces may be off by as much.
        """
        with self._lock:
            return self._core.depth_unit

    @property
    def noise_factor(self) -> float:
        """
        By how much registered frames are noisier than one image shows: at least 1.

        Neighbouring pixels share errors, those of stereo cameras above all, which show in residuals between
        frames alone. Gates and spacing follow. 1 where ``depth.noise`` or ``registration.final_distance`` is
        given.
        """
        with self._lock:
            return self._core.noise_factor

    def cloud(self, *, all_points: bool = False) -> Cloud:
        """
        Return the points that are a surface, with all that is known of each.

        Parameters
        ----------
        all_points : bool
            Those, too, that :func:`nacre.meshing.on_surface` tells from it: litter, doubled layers, and
            normals that contradict; and of an object on a plane (``region={"object": True}``) parts beside
            it. The model keeps them, since a later frame may confirm them.

        Returns
        -------
        Cloud
            Points [m], normals, colours where there are any; as attributes ``confidence``, ``last_seen``,
            ``sigma`` (:attr:`point_sigma`, [m]) and the model's own.
        """
        from nacre.io.cloud import Cloud

        with self._lock:
            self._whole = self._points
            try:
                points, normals, colors = self.points, self.normals, self.colors
                confidence, last_seen = self.confidence, self.last_seen
                more = {
                    "confidence": confidence,
                    "last_seen": last_seen,
                    "sigma": self.point_sigma.astype(np.float32),
                    **self.attributes,
                }
                frames = self.frames
            finally:
                self._whole = None
        rows = (
            slice(None)
            if all_points
            else surface_rows(points, normals, confidence, last_seen, frames, self.parameters.region)
        )
        return Cloud(
            points[rows],
            normals[rows],
            None if colors is None else colors[rows],
            {name: values[rows] for name, values in more.items()},
        )

    def points_at(self, frame: int) -> npt.NDArray[np.float32]:
        """
        Return the points as they were at a frame, where the model deforms (``deform=True``).

        Parameters
        ----------
        frame : int
            Its index. At a frame that is lost the shape is that of the one before; surface first seen
            later is carried by what was there.

        Returns
        -------
        (N, 3) float32
            In the order of :attr:`points`, which are the canonical shape; in the world frame [m].

        Raises
        ------
        ValueError
            Where the model does not deform, or has no such frame.

        Notes
        -----
        After Sumner, Schmid and Pauly 2007 (embedded deformation) and Newcombe, Fox and Seitz 2015
        (DynamicFusion).
        """
        return self._shape_at(frame).points

    def normals_at(self, frame: int) -> npt.NDArray[np.float32]:
        """Return the (N, 3) unit normals of :meth:`points_at`."""
        return self._shape_at(frame).normals

    def nodes_at(self, frame: int) -> npt.NDArray[np.float32]:
        """Return where the (K, 3) nodes of the warp field were at a frame [m]; see :meth:`points_at`."""
        return self._shape_at(frame).nodes

    def _shape_at(self, frame: int) -> _core.ShapeAtFrame:
        index = as_count("frame", frame)
        with self._lock:
            return self._core.shape_at(index)

    def in_camera(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Return points and normals in the newest registered camera's frame, as the paper keeps its model."""
        with self._lock:
            cloud = self._core.cloud_in_camera()
        return cloud.points, cloud.normals
