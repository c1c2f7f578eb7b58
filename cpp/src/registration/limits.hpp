// Numbers that decide how surfaces are registered.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

// clang-format off
namespace nacre::registration_limits {

constexpr std::size_t scale_probes = 1000;  // [pairs] budget: that tell the scale of the residuals; test_icp
constexpr std::size_t cell_pairs = 32;  // [pairs] budget: in the order of space, whose mean residual tells what they share; test_icp
constexpr double cell_resolution = 0.06;  // [1] tuned: of the largest residual, that neighbors may share; unrelated, docs/algorithms/tracking.md
constexpr double least_variance = 1e-3;  // [1] derived: of a normal's components: none is more certain than 2 degrees; unrelated
constexpr double unknown_noise_bias = 0.008;  // [1] derived: noise bias of the Hessian where a normal's error is unknown: 5 degrees; test_icp, poster60-gray
constexpr double least_signal = 1.0;  // [1] derived: information by what noise in normals feigns: with less, noise decides; test_open_directions
constexpr double signal_at_rest = 3.0;  // [1] derived: the same where shared errors may hold a camera: if half of them are shared, twice as much is feigned again; test_open_directions
constexpr double first_gate = 0.25;  // [diameter] tuned: largest residual of the first iteration where none is given; test_icp
constexpr int most_level_steps = 8;  // [steps] budget: before more points are taken; test_icp
constexpr double angle_narrowing = 3.0;  // [1] tuned: normals may differ more by one part of so many while a source is far off; test_residual_noise
constexpr double any_angle = 3.14159;  // [rad] derived: a largest angle that every pair passes, rounding or not; test_icp
constexpr double still_spacings = 1e-3;  // [spacing] derived: a step that no data explains; test_icp
constexpr double least_resolution = 1e-9;  // [m] derived: likewise, where points have no spacing; test_icp
constexpr double still_uncertainty = 0.04;  // [1] budget: a step a fifth of what noise leaves uncertain in an unknown, squared; test_icp
constexpr std::size_t least_pairs_of_paper_icp = 6;  // [pairs] derived: as many as a motion has unknowns; test_paper_icp
constexpr double rest_of_paper_icp = 1e-6;  // [1] derived: step, of the largest residual, that no data explains; test_paper_icp
constexpr std::int64_t spacing_probes = 500;  // [points] budget: that tell a cloud's spacing; test_icp
constexpr std::size_t least_scale_rows = 16;  // [rows] derived: for seven unknowns; test_scale_check
constexpr double least_brightness_noise = 1.0;  // [1/255] derived: of the brightness: a step of its scale; test_color_registration
constexpr double small_color_step = 0.01;  // [spacing] budget: of a search by color that has converged; test_color_registration
constexpr std::int64_t coarse_color_step = 9;  // [points] budget: one of so many is enough at first, three times as far apart; test_color_registration
constexpr int color_neighbors = 16;  // [points] budget: around a point, that show how brightness changes; test_color_registration
constexpr int least_color_neighbors = 6;  // [points] derived: for three unknowns with some to spare; test_color_registration
constexpr double color_reach = 4.0;  // [spacing] derived: of them: sixteen neighbours in a square grid are within 2.3, and may be almost twice as far apart; test_color_registration
constexpr double color_falloff = 0.9;  // [1] tuned: by which the farthest of them counts less than the nearest; test_color_registration
constexpr double largest_gain = 4.0;  // [1] budget: between the brightnesses of two images, two stops of exposure; test_color_registration
constexpr double least_distance_noise = 0.1;  // [spacing] tuned: of shapes, that colors are held against: points stand for surfaces no better; test_color_registration
constexpr double least_residual_scale = 0.05;  // [gate] tuned: of pairs of views, where no noise is seen; test_loop_closure
constexpr int mean_neighbors = 24;  // [points] tuned: that a noisy point is averaged with; test_global_registration
constexpr Eigen::Index roughness_probes = 500;  // [points] budget: that tell a cloud's noise; test_global_registration
constexpr double search_gate = 0.04;  // [size] tuned: at the end of the search, and of candidates that are refined; closer shifts are the same; test_global_registration
constexpr double least_tolerance = 0.003;  // [size] tuned: to which surfaces agree at the end, at least; test_global_registration
constexpr double center_depth = 0.7;  // [radius] derived: from what is seen of an object to its center; a half sphere has 0.6; test_global_registration
constexpr double points_per_cell = 6.0;  // [points] budget: of a cloud seen from a place; test_global_registration
constexpr int most_cells = 256;  // [cells] budget: across a cloud's range image; test_global_registration
constexpr int uncertain_cells = 2;  // [cells] derived: from points, where nothing is certain; test_global_registration
constexpr int least_filled_cells = 8;  // [cells] tuned: of nine, to know what is in front and behind; test_global_registration
constexpr double seen_through_weight = 3.0;  // [1] tuned: of a point of a view, beside one that agrees; test_global_registration, dog
constexpr double occluded_weight = 0.5;  // [1] tuned: likewise: others may stand before; test_global_registration, dog
constexpr double beyond_weight = 2.0;  // [1] tuned: likewise: an outline may err by pixels; test_global_registration, dog
constexpr double chance_ratio = 0.58;  // [1] derived: residuals to the largest that match, by chance: 1 / sqrt(3); test_acceptance
constexpr double least_ratio = 0.01;  // [1] tuned: data without noise is no more certain; test_acceptance
constexpr double consistency_power = 4.0;  // [1] tuned: in the registration score; unrelated
constexpr double far_consistency_power = 12.0;  // [1] tuned: the same far from all guesses, and in the relocalisation score; unrelated, cabinet
constexpr double wrong_contradiction = 0.1;  // [1] tuned: mean part of a wrong place that is seen through, where a third matches; unrelated
constexpr double least_contradiction = 0.01;  // [1] tuned: that tells one place from another; benchmarks/acceptance.py
constexpr double usual_weight = 2.0;  // [1] tuned: of a place that contradicts as usual, in the registration score: 3 % of wrong ones reach min_score; benchmarks/acceptance.py
constexpr double far_misfit = 0.5;  // [1] tuned: beside the last pose, and far from all guesses, what bends more counts less; unrelated
constexpr double doubtful_score = 1.2;  // [min_score] tuned: asked after a loss, and far from all guesses; unrelated
constexpr double only_near_score = 0.4;  // [min_score] tuned: of the best of many places near the last pose, where no other comes near: of 45 with more, below min_score, 43 are right; benchmarks/acceptance.py
constexpr double usual_off_planes = 0.2;  // [1] tuned: of the matches, that lie off three planes where the place is right; unrelated, icl
constexpr std::size_t plane_pairs = 500;  // [pairs] budget: that tell what lies off three planes; test_dominant_planes
constexpr std::size_t plane_probes = 20;  // [pairs] budget: of them, whose planes are tried; test_dominant_planes
constexpr double clear_cut_score = 2.0;  // [min_score] tuned: no other guess needs to be tried; benchmarks/run.py
constexpr double other_size = 0.025;  // [1] tuned: by which another thing is larger; right ones by 0.015 at most; test_acceptance
constexpr double size_sigmas = 5.0;  // [sigma] tuned: by which a size near a guess must differ; one known no better than other_size says nothing; test_acceptance
constexpr double far_size_sigmas = 3.0;  // [sigma] tuned: by which it must differ far from all guesses; unrelated
constexpr double chance_relocalisation = 0.3;  // [1] tuned: relocalisation score that one of ten wrong places has; unrelated
constexpr double enough_together = 0.45;  // [1] tuned: log-odds of a place, from several views; teddy-cut
constexpr double enough_alone = 1.3;  // [1] tuned: relocalisation score of a single view; none of 1000 wrong ones above 1.02; unrelated
constexpr double enough_far = 2.0;  // [1] tuned: the same far from all guesses; unrelated
constexpr Eigen::Index view_samples = 800;  // [points] budget: of each view; bunny12
constexpr double still = 1e-6;  // [rad, m] derived: motions of all views that have converged; bunny12
constexpr int most_steps = 12;  // [steps] budget: of Gauss-Newton, by colours, by outlines, and of views together; bunny12, fandisk12
constexpr double gate_decay = 0.8;  // [1] budget: of a registration by outlines, at each step; fandisk12

}  // namespace nacre::registration_limits
// clang-format on
