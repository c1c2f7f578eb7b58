// Numbers that decide what outlines say of a pose.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

// clang-format off
namespace nacre::outlines_limits {

constexpr double look_across = 3.0;  // [pixel] derived: from an edge, where it is asked what is there: nearer pixels see both of its sides; fandisk12, cabinet
constexpr int border_pixels = 3;  // [pixels] derived: of an image, where cleaning may have removed some; test_occluding_edges
constexpr int window_radius = 6;  // [pixels] tuned: of the window that shows the surface; test_occluding_edges
constexpr double least_offset = 0.25;  // [radius] derived: of the window's pixels from its center; a half window has 0.42; test_occluding_edges
constexpr double most_offset = 0.65;  // [radius] derived: likewise; a corner of 90 degrees has 0.6; test_occluding_edges
constexpr double least_filled = 0.18;  // [1] derived: part of the window that shows the surface; a corner of 90 degrees has 0.25; test_occluding_edges
constexpr double sag_sigmas = 2.5;  // [sigma] tuned: by which a surface bends towards its outline, if it does; test_occluding_edges
constexpr int num_rounds = 4;  // [rounds] budget: of steps along the outline, each then back onto the surface; fandisk12, cabinet
constexpr int least_steps = 4;  // [steps] budget: in each round; fandisk12, cabinet
constexpr double step_damping = 1e-3;  // [1] derived: of the information, where few rows determine a direction; fandisk12
constexpr double first_gate = 12.0;  // [pixel] tuned: of an object seen whole also a third of its size; fandisk12, cabinet
constexpr double last_gate = 4.0;  // [pixel] tuned: of matches, at last; fandisk12, cabinet
constexpr double least_agreement = 0.6;  // [1] tuned: part of the outlines that must match; poster60-gray
constexpr double largest_ratio = 0.4;  // [1] derived: residuals to the gate, root mean square; chance gives 0.58; poster60-gray
constexpr double least_noise = 0.3;  // [pixel] derived: pixels are where they are to half of one; poster60-gray
constexpr double largest_rms = 1.0;  // [pixel] tuned: of the residuals; outlines that move with the camera have 1.3 to 1.9; fandisk12, cabinet
constexpr double point_sigma = 0.5;  // [pixel] derived: of an outline's point; fandisk12, cabinet
constexpr double points_for_one = 4.0;  // [points] tuned: neighbors on an outline err together; fandisk12, cabinet
constexpr double pairs_for_one = 30.0;  // [pairs] tuned: so do pairs of surface points; fandisk12, cabinet
constexpr double smear_step = 0.5;  // [pixel] budget: between places that are asked across an edge; test_occluding_edges
constexpr double most_smeared = 2.5;  // [pixel] tuned: of an edge, over which depth falls off; test_occluding_edges
constexpr std::size_t least_matches = 25;  // [pairs] tuned: of outlines that decide a direction; fandisk12, poster60-gray

}  // namespace nacre::outlines_limits
// clang-format on
