"""All parameters: frozen dataclasses, each the mirror of a C++ struct; a test compares the defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from nacre import _core
from nacre._internal.arrays import as_camera
from nacre._internal.core_options import TypedFields, from_core
from nacre.noise import NoiseModel, NoiseName, as_noise

EdgeTest = Literal["inverse_depth", "gradient", "none"]
Method = Literal["point_to_point", "point_to_plane", "symmetric", "paper"]
Preset = Literal["default", "paper"]


@dataclass(frozen=True)
class DepthParameters(TypedFields):
    """
    What :func:`nacre.preprocess_depth` removes; see there for each field.

    Mirrors the C++ ``DepthOptions``; ``noise=None`` measures the noise: from the image itself, or from all
    images of a model so far.
    """

    edge_test: EdgeTest = "inverse_depth"
    min_depth: float = 0.0
    max_depth: float = math.inf
    gradient_threshold: float = 0.005
    edge_dilation: int = 1
    edge_sigmas: float = 4.0
    planar_keep_sigmas: float = 3.0
    max_slant: float = 1.3962634
    max_missing: float = 0.6
    min_component: int = 20
    tilt: float = 0.0
    noise: NoiseModel | NoiseName | None = None

    def for_camera(self, camera: _core.Camera) -> DepthParameters:
        """Return the same with the noise model of that camera, where only its kind is named."""
        return replace(self, noise=as_noise("depth.noise", self.noise, as_camera("camera", camera)))


@dataclass(frozen=True)
class RegionParameters(TypedFields):
    """
    The region of interest; see :func:`nacre.select_region` for each field.

    Mirrors the C++ ``RegionOptions``; the defaults leave nothing out.
    """

    min_x: float = -math.inf
    max_x: float = math.inf
    min_y: float = -math.inf
    max_y: float = math.inf
    min_z: float = -math.inf
    max_z: float = math.inf
    object: bool = False
    min_object: float = 0.003
    plane_margin: float = 0.0


@dataclass(frozen=True)
class RegistrationParameters(TypedFields):
    """How :func:`nacre.align` works; see there for each field. Mirrors ``AlignOptions``, less its threads."""

    method: Method = "symmetric"
    max_iterations: int = 40
    max_distance: float = 0.0
    final_distance: float = 0.0
    gate_decay: float = 0.7
    max_angle: float = 0.7853982
    robust: bool = True
    sample_fraction: float = 1.0
    max_points: int = 10000
    max_samples: int = 5000
    coarse_samples: int = 600
    keep_best: bool = False
    weak_threshold: float = 0.002
    seed: int = 0


@dataclass(frozen=True)
class GlobalRegistrationParameters(TypedFields):
    """
    How :func:`nacre.align_global` works; see there for each field.

    Mirrors the C++ ``GlobalAlignOptions``.
    """

    num_rotations: int = 288
    num_candidates: int = 16
    tolerance: float = 0.0
    max_angle: float = 0.5235988
    outlines: bool = False
    min_overlap: float = 0.15
    min_consistency: float = 0.7
    max_residual: float = 0.8
    max_rivalry: float = 0.7
    max_points: int = 10000
    max_samples: int = 2000
    coarse_samples: int = 250
    seed: int = 0
    num_threads: int = 0


@dataclass(frozen=True)
class FusionParameters(TypedFields):
    """
    How frames are fused into a model. Mirrors the C++ ``FusionOptions``.

    Attributes
    ----------
    max_confidence : float
        Bounds the confidence from above, so that new observations always count.
    min_observations : int
        A point that fewer frames observed is not confirmed.
    max_free_space_violations : int
        A point that a camera saw through so often goes; an unconfirmed one also where cameras looked so often
        and did not find it.
    reference_sigma : float
        Noise of an observation of weight 1 [m]; 0: the frame's median.
    """

    max_confidence: float = 1e6
    min_observations: int = 3
    max_free_space_violations: int = 3
    reference_sigma: float = 0.0


@dataclass(frozen=True)
class WlopParameters(TypedFields):
    """
    How WLOP fuses frames; see :func:`nacre.consolidate`. Mirrors the C++ ``WlopOptions``.

    Attributes
    ----------
    radius : float
        Support radius [m].
    iterations : int
        Of each frame.
    mu : float
        Weight of the repulsion, 0 to 0.5.
    theta : "huang" or "printed"
        The weight of a point by its distance.
    first_fraction : float
        "wlop": part of the first frame that becomes the model.
    kept_fraction : float
        "wlop": part of the model that is kept at each frame.
    new_fraction : float
        "wlop": new points, as a part of the model.
    normal_neighbors : int
        From which the normal of a point of the model is estimated, itself included.
    normal_radius : float
        How far away they may be [m].
    seed : int
        Of the choice of points.
    """

    radius: float = 0.008
    iterations: int = 10
    mu: float = 0.4
    theta: Literal["huang", "printed"] = "huang"
    first_fraction: float = 0.5
    kept_fraction: float = 0.9
    new_fraction: float = 0.2
    normal_neighbors: int = 16
    normal_radius: float = math.inf
    seed: int = 0


@dataclass(frozen=True)
class ModelParameters(TypedFields):
    """
    All parameters of a model. Mirrors the C++ ``ModelOptions``.

    Attributes
    ----------
    depth, region, registration, fusion, wlop
        Of the steps of the loop; ``fusion`` where ``fusion_method`` is "fuse", ``wlop`` where it is not.
    fusion_method : "fuse", "wlop" or "wlop+"
        How a registered frame becomes part of the model: confidence-weighted fusion, the 2010 paper's WLOP of
        model and new points, or WLOP repaired for incremental use.
    binning : int
        Of a pinhole camera: each so many by so many pixels are averaged to one before all else. 1: none; 0:
        as few as leave 100 000 measured pixels of the first image, and hardly any gaps between them; none
        where the unit of its depth is coarser than such a pixel, or where a ``region`` is asked for. See
        :attr:`nacre.Model.binning`.
    calibrate_depth : bool
        Of a pinhole camera that sees one scene (no ``region``), depth along its axis: where views in several
        directions show that its depth is systematically wrong, correct it from then on, and what was there
        (:func:`nacre.calibrate_depth`).
    deform : bool
        The object bends: the model is its canonical shape, and how it was at each frame is known
        (:meth:`nacre.Model.points_at`). Where ``fusion_method`` is "fuse"; without ``loop_closure`` and
        ``calibrate_depth``.
    spacing : float
        Distance between model points [m]; 0: twice a pixel on the first frame's nearer surfaces. New points
        are also at least a pixel and a half apart in the frame that brings them, and an averaged pixel.
    max_points : int
        The model never grows beyond: its spacing is widened instead.
    predict_motion : bool
        Start also from the pose that continues the last motion.
    relocalise : bool
        Search where the guesses fail: for an object that turned by any angle on the plane on which it stands
        (``region.object``), around earlier poses, then everywhere (some tenths of a second; not at every
        frame where that has failed often).
    loop_closure : bool
        Where ``fusion_method`` is "fuse": correct model and poses where the camera comes back to what it saw
        before.
    denoise_samples : bool
        Register surface points averaged over their pixels, not single pixels.
    verify : bool
        Test registrations by their score before they are accepted.
    min_score : float
        A frame with less is lost; see :class:`nacre.FrameReport`.
    num_threads : int
        0: all.
    """

    depth: DepthParameters = field(default_factory=DepthParameters)
    region: RegionParameters = field(default_factory=RegionParameters)
    registration: RegistrationParameters = field(default_factory=RegistrationParameters)
    fusion_method: Literal["fuse", "wlop", "wlop+"] = "fuse"
    fusion: FusionParameters = field(default_factory=FusionParameters)
    wlop: WlopParameters = field(default_factory=WlopParameters)
    binning: int = 0
    calibrate_depth: bool = True
    deform: bool = False
    spacing: float = 0.0
    max_points: int = 500000
    predict_motion: bool = True
    relocalise: bool = True
    loop_closure: bool = True
    denoise_samples: bool = True
    verify: bool = True
    min_score: float = 0.3
    num_threads: int = 0

    @classmethod
    def preset(cls, name: Preset) -> ModelParameters:
        """Return "default" (what measures best) or "paper" (the 2010 paper's algorithm, alone)."""
        if not isinstance(name, str):
            raise TypeError(f"preset must be 'default' or 'paper', got {name!r}")
        return from_core(cls, _core.ModelOptions.preset(name))
