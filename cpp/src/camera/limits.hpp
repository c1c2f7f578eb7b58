// Numbers that decide when two views are one.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>

// clang-format off
namespace nacre::camera_limits {

constexpr double view_turn = 0.2;  // [rad] tuned: turn that makes another view, and another candidate of a search; test_loop_closure, test_global_registration
constexpr double view_shift = 0.15;  // [depth] tuned: shift that makes another view, and drift that is looked for within one; test_loop_closure
constexpr double least_point_pixels = 1.5;  // [pixel] tuned: of the sensor, between new points in their frame, which has one for each of its own at most; bunny12
constexpr float least_facing = 0.3F;  // [cosine] tuned: at which a surface should be seen; test_global_registration, dog
constexpr double surface_spacings = 2.75;  // [spacing] tuned: across a surface, within which points are of it; teddy, test_correction
constexpr double steepest = 3.0;  // [1] tuned: slope up to which neighbouring pixels see one surface; test_planar_edges, test_occluding_edges, test_region
constexpr double another_surface = 0.05;  // [depth] tuned: between surfaces that are not one; test_moving_things, test_depth_calibration
constexpr double new_direction = 0.35;  // [rad] tuned: between views from different sides, and from a guess to a place that was not expected; dog, teddy-cut, unrelated
constexpr double projection_rounding = 1e-5;  // [1] derived: of a coordinate, that turning it into a camera's frame in single precision costs at most: a dozen roundings of 2^-24, ten times; test_block_index

}  // namespace nacre::camera_limits
// clang-format on
