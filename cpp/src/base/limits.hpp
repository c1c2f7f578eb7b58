// Numbers that decide in many places.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

// clang-format off
namespace nacre::base_limits {

constexpr float noise_sigmas = 4.0F;  // [sigma] derived: what noise does not reach, but for 1 of 16 000; test_frame, test_fusion, test_depth, test_occluding_edges, test_global_registration
constexpr double same_surface_cosine = 0.8;  // [cosine] tuned: between normals of neighbours on one surface, and of views that match; test_global_registration, test_depth_calibration
constexpr float same_side_cosine = 0.3F;  // [cosine] tuned: between normals of points that stand for one side of a thing; test_fusion, test_meshing
constexpr double damping = 1e-9;  // [1] derived: of the mean information, so that there always is a solution; test_icp
constexpr double longest_step = 2.0;  // [1] budget: of Gauss and Newton's, where it is made longer; test_step_length, test_depth_calibration
constexpr int least_points = 50;  // [points] tuned: that decide anything; poster60-gray, test_failure

}  // namespace nacre::base_limits
// clang-format on
