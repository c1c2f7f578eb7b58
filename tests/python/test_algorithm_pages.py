"""The constants that the pages on algorithms name are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "algorithms"
SOURCES = ROOT / "cpp" / "src"
MESHING = "../../python/nacre/meshing/"

# page, what it says; file, what it says there.
CONSTANTS = [
    ("depth", r"3\, d\, s_w", "camera/limits.hpp", "steepest = 3.0;"),
    ("depth", r"(0.8\, k \sqrt 6\, g)^2", "depth/limits.hpp", "lateral_sigma = 0.8F"),
    ("depth", r"(4 \sqrt 2\, \sigma_w)^2", "base/limits.hpp", "noise_sigmas = 4.0F"),
    ("depth", r"$1.5\,\sigma_w^2$", "simd/depth_planar_edges.cpp", "largest_misfit = 1.5F"),
    ("depth", "3 x 5 next to it", "simd/depth_planar_edges.hpp", "side_depth = 3, side_reach = 2"),
    ("noise", "0.1192", "depth/limits.hpp", "smooth_left = 0.1192"),
    ("noise", "0.0145", "depth/limits.hpp", "smooth_bent = 0.0145"),
    ("noise", "at most 0.85 of it", "depth/limits.hpp", "most_shared = 0.85"),
    ("noise", "The 0.4-quantile", "depth/limits.hpp", "noise_quantile = 0.4"),
    ("noise", "more than a tenth of the windows", "depth/limits.hpp", "least_stepped = 0.1"),
    ("noise", "36 bins", "../include/nacre/depth.hpp", "num_bins = 36"),
    ("noise", "at least a hundredth", "depth/limits.hpp", "most_frames = 100.0"),
    ("noise", "drawn by a hundredth", "depth/limits.hpp", "prior_weight = 0.01"),
    ("noise", r"0.0015\,\mathrm m^{-2}", "depth/limits.hpp", "systematic_growth = 0.0015F"),
    ("normals", r"4\sqrt 2\,\sigma_w + 5.67\,\delta\,s_w", "depth/limits.hpp", "gate_slope = 5.67F"),
    ("normals", r"0.07\, s_w", "depth/limits.hpp", "slope_sigma = 0.07F"),
    ("normals", "less than 0.4 of the window", "depth/limits.hpp", "least_filled = 0.4F"),
    ("normals", "below 0.005", "simd/tree_plane_fit.cpp", "line_share = 0.005"),
    ("normals", r"$\lambda > 0.22$", "simd/tree_plane_fit.cpp", "space_share = 0.22"),
    (
        "registration",
        "a quarter of the target's diameter",
        "registration/limits.hpp",
        "first_gate = 0.25",
    ),
    ("registration", "2.75 times the target's spacing", "camera/limits.hpp", "surface_spacings = 2.75"),
    ("registration", r"at least $4 s$", "base/limits.hpp", "noise_sigmas = 4.0F"),
    ("registration", r"6 \cdot 0.04\, s^2", "registration/limits.hpp", "still_uncertainty = 0.04"),
    ("registration", "at most 30 000", "tracking/limits.hpp", "most_target_points = 30000"),
    ("registration", "1.5 times the distance", "tracking/limits.hpp", "reach_spacings = 1.5"),
    ("registration", "2.75 times that", "camera/limits.hpp", "surface_spacings = 2.75"),
    ("global", r"0.003\, D", "registration/limits.hpp", "least_tolerance = 0.003"),
    (
        "global",
        r"from $0.25 D$ to $0.04 D$",
        "registration/limits.hpp",
        "first_gate = 0.25",
    ),
    ("global", r"$0.04 D$", "registration/limits.hpp", "search_gate = 0.04"),
    ("global", "by 0.2 rad", "camera/limits.hpp", "view_turn = 0.2"),
    ("global", "0.7\n   radii", "registration/limits.hpp", "center_depth = 0.7"),
    ("global", "24 neighbours", "registration/limits.hpp", "mean_neighbors = 24"),
    (
        "global",
        r"A - 3 F - \tfrac12 H",
        "registration/view_agreement.hpp",
        "agree - seen_through_weight * seen_through - occluded_weight * occluded",
    ),
    ("global", r"A - 3 F", "registration/limits.hpp", "seen_through_weight = 3.0"),
    ("global", r"\tfrac12 H", "registration/limits.hpp", "occluded_weight = 0.5"),
    (
        "tracking",
        r"O^2\, (C\, C_s)^p",
        "registration/acceptance.cpp",
        "std::pow(consistency.of_target * consistency.of_source, demands.consistency_power)",
    ),
    ("tracking", "errs by a quarter of itself", "tracking/limits.hpp", "odometry_error = 0.25"),
    ("noise", r"1.376\, \overline m", "tracking/limits.hpp", "noise_per_residual = 1.376"),
    ("noise", "Until five frames", "tracking/limits.hpp", "enough_frames = 5.0"),
    ("depth", "100 000 measured", "depth/limits.hpp", "most_worked_on = 100000.0"),
    ("noise", "4, 8 and 16 times", "tracking/limits.hpp", "largest_noise_factor = 16.0"),
    ("simulation", "0.8 + 0.035", "simulation/limits.hpp", "lateral_constant = 0.8"),
    ("simulation", r"\frac{0.0001}{\sqrt z}", "simulation/limits.hpp", "axial_slant = 0.0001"),
    ("simulation", "| 50 | 1/32 | 4.5 |", "simulation/limits.hpp", "stereo_window = 4.5"),
    ("simulation", "0.002, 0.018, 0.1", "simulation/limits.hpp", "stereo_fine = 0.018"),
    ("simulation", "| 75 | 1/8 | 3.6 |", "simulation/limits.hpp", "light_window = 3.6"),
    ("simulation", "0.01, 0.03, 0.03", "simulation/limits.hpp", "light_broad = 0.03"),
    ("simulation", r"{0.04\, g}", "simulation/limits.hpp", "guide_tolerance = 0.04"),
    ("simulation", "noisy by 0.08 %", "simulation/limits.hpp", "lidar_fine = 0.0008"),
    ("tracking", r"O\, C^{12}", "registration/limits.hpp", "far_consistency_power = 12.0"),
    ("tracking", r"2.0\, O\, \frac", "registration/limits.hpp", "usual_weight = 2.0"),
    ("tracking", r"\bar c + 0.01", "registration/limits.hpp", "least_contradiction = 0.01"),
    ("tracking", "by up to 0.35 rad", "camera/limits.hpp", "new_direction = 0.35"),
    ("tracking", "0.15, which", "tracking/limits.hpp", "beside_turn = 0.15"),
    ("tracking", r"\frac{0.1}{\bar c}", "registration/limits.hpp", "wrong_contradiction = 0.1"),
    ("tracking", "and 5 near one.", "registration/limits.hpp", "size_sigmas = 5.0"),
    ("tracking", "with $k = 3$ far from all guesses", "registration/limits.hpp", "far_size_sigmas = 3.0"),
    ("tracking", "| 1.2 times as much | 4 | 1", "registration/limits.hpp", "doubtful_score = 1.2"),
    ("tracking", "| 1.2 times as much | 4 | 0.5", "registration/limits.hpp", "far_misfit = 0.5"),
    ("noise", r"$m \ge 0.5$", "tracking/limits.hpp", "least_residual_sigmas = 0.5"),
    ("tracking", "| 12 | 0.5 |", "registration/limits.hpp", "far_consistency_power = 12.0"),
    ("tracking", r"f / 0.2", "registration/limits.hpp", "usual_off_planes = 0.2"),
    ("tracking", r"\max(0.025,", "registration/limits.hpp", "other_size = 0.025"),
    ("tracking", "blocks $b$ of 32", "registration/limits.hpp", "cell_pairs = 32"),
    ("tracking", "0.58", "registration/limits.hpp", "chance_ratio = 0.58"),
    ("tracking", "twice `min_score`", "registration/limits.hpp", "clear_cut_score = 2.0"),
    (
        "tracking",
        "by less than 0.35 rad, moved by less than 0.26",
        "camera/limits.hpp",
        "new_direction = 0.35",
    ),
    (
        "tracking",
        "more than ICP's largest angle",
        "model/localisation.cpp",
        "> options.registration.max_angle",
    ),
    ("tracking", "at every eighth", "model/limits.hpp", "patience = 8"),
    ("tracking", r"$\mathcal R - 0.3$", "registration/limits.hpp", "chance_relocalisation = 0.3;"),
    ("tracking", "0.45 from at least two views", "registration/limits.hpp", "enough_together = 0.45"),
    ("tracking", r"\mathcal R \ge 1.3", "registration/limits.hpp", "enough_alone = 1.3"),
    ("tracking", "2.0 far from all guesses", "registration/limits.hpp", "enough_far = 2.0"),
    ("fusion", r"$6\sigma$ within 3 to 4", "fusion/limits.hpp", "support_sigmas = 6.0F"),
    (
        "fusion",
        r"\max(3 \cos\theta, 1)",
        "fusion/limits.hpp",
        "insertion_pixels = 3.0F",
    ),
    ("fusion", "1.5\\ \\mathrm{pixels", "camera/limits.hpp", "least_point_pixels = 1.5"),
    ("fusion", "multiplied by 1.25", "model/limits.hpp", "coarsening = 1.25"),
    ("consolidation", "(0.02 h)^2", "consolidation/limits.hpp", "softening2 = 4e-4"),
    ("consolidation", "at least $0.1/h$", "consolidation/limits.hpp", "least_repulsion = 0.1"),
    ("consolidation", "at most $h/4$", "consolidation/limits.hpp", "longest_step = 0.25"),
    ("loops", "0.2 rad, or of 0.15", "camera/limits.hpp", "view_turn = 0.2"),
    ("loops", "the last twelve nodes", "loops/limits.hpp", "verified_nodes = 12"),
    ("loops", "at least 0.3 is in view", "loops/limits.hpp", "least_overlap = 0.3"),
    ("loops", "at most 1000", "loops/limits.hpp", "most_key_frames = 1000"),
    ("loops", "3000 points", "loops/limits.hpp", "key_frame_points = 3000"),
    ("loops", "newest 32 key frames", "loops/limits.hpp", "newest_key_frames = 32"),
    ("loops", "32 that were looked at last", "loops/limits.hpp", "recalled_key_frames = 32"),
    ("loops", "4 times the\ncovariance", "loops/limits.hpp", "covariance_inflation = 4.0"),
    ("loops", "0.005 rad", "loops/limits.hpp", "drift = 0.005"),
    ("loops", "more than four standard deviations", "base/limits.hpp", "noise_sigmas = 4.0F"),
    ("loops", "more than about 0.15 of the depth", "camera/limits.hpp", "view_shift = 0.15"),
    ("objects", "160 hypotheses", "region/limits.hpp", "num_hypotheses = 160"),
    ("objects", "at most 20 000", "region/limits.hpp", "most_cells = 20000"),
    ("objects", "within 0.008 of its distance", "region/limits.hpp", "bend = 0.008F"),
    ("objects", "(0.3 of its size)", "region/limits.hpp", "small_part = 0.3"),
    ("objects", "72 angles", "tracking/limits.hpp", "num_turns = 72"),
    ("objects", "are 0.7 of those", "../include/nacre/global_registration.hpp", "min_consistency = 0.7"),
    ("objects", "At least 25 pairs", "outlines/limits.hpp", "least_matches = 25"),
    ("objects", "0.6 of both outlines", "outlines/limits.hpp", "least_agreement = 0.6"),
    ("meshing", "$1.75 s$", "mesh/limits.hpp", "largest_circle = 1.75"),
    ("meshing", "20 nearest", "mesh/limits.hpp", "most_neighbors = 20"),
    ("meshing", "64 nearest", "mesh/limits.hpp", "covering_neighbors = 64"),
    ("meshing", "part of at least 30", "mesh/limits.hpp", "least_part = 30"),
    ("meshing", "up to ten edges", "mesh/limits.hpp", "longest_hole = 10"),
    ("meshing", "into 40 stretches", MESHING + "texture_views.py", "_MOST_VIEWS = 40"),
    ("meshing", "four images that are read", MESHING + "texture_views.py", "_READ_OF_EACH_STRETCH = 4"),
    ("meshing", "three pixels in one", MESHING + "texture_visibility.py", "_COARSER = 3"),
    ("meshing", "at least 0.15 towards", MESHING + "texture_visibility.py", "_LEAST_FACING = 0.15"),
    ("meshing", "over 16 by 16 pixels", MESHING + "texture_exposure.py", "_BLOCK = 16"),
    ("meshing", "least half of the best scores", MESHING + "texture_labels.py", "_GOOD = 0.5"),
    ("meshing", "fewer than 50 triangles", MESHING + "texture_labels.py", "_SMALL = 50"),
    ("meshing", "at 5000 vertices", MESHING + "texturing.py", "_PLACES = 5_000"),
    ("meshing", "100 rounds of averages", MESHING + "texture_exposure.py", "_FADING = 100"),
    ("meshing", "8192 by 8192", MESHING + "texture_atlas.py", "MOST_PIXELS = 8192"),
    ("meshing", "cells of 4 by 4", MESHING + "texture_atlas.py", "CELL = 4"),
    ("simulation", "over 8 x 8 rays", "simulation/limits.hpp", "rays_per_radius = 4"),
    ("neighbours", "blocks of 16", "simd/tree_layout.hpp", "block_points = 16"),
]


def flat(text: str) -> str:
    """Return a text with every run of white space as one blank."""
    return re.sub(r"\s+", " ", text)


@pytest.mark.parametrize(("page", "said", "file", "coded"), CONSTANTS)
def test_what_a_page_says_is_coded(page: str, said: str, file: str, coded: str) -> None:
    assert flat(said) in flat((PAGES / f"{page}.md").read_text(encoding="utf-8")), f"{page}.md has changed"
    source = (SOURCES / file).read_text(encoding="utf-8")
    assert flat(coded) in flat(source), f"{file} has changed: does {page}.md still tell the truth?"


@pytest.mark.parametrize("page", sorted(PAGES.glob("*.md")), ids=lambda page: page.stem)
def test_a_page_has_what_a_reader_expects(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "../images/" in text or page.stem == "index"
    if page.stem not in ("index", "paper"):
        for heading in ("## Parameters", "## Limits"):
            assert heading in text
        assert "`cpp/src/" in text  # where it is coded
        assert "$" in text or page.stem == "neighbours"
