// Numbers that decide what two images show alike.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

// clang-format off
namespace nacre::keypoints_limits {

constexpr int tensor_radius = 2;  // [pixels] derived: of the window whose brightness makes a corner: gradients of three pixels, five of them; test_keypoints
constexpr double least_strength = 0.002;  // [1] tuned: of a corner, by the image's strongest; test_keypoints
constexpr int cell_size = 8;  // [pixels] budget: of a cell, of which one corner is kept; test_keypoints
constexpr std::size_t most_keypoints = 800;  // [keypoints] budget: of an image; test_keypoints
constexpr double window_radius = 11.0;  // [pixels] tuned: of what a descriptor sees, at the usual depth; test_keypoints, boxcan
constexpr int disk_steps = 7;  // [steps] budget: across half of it, that tell where it is brighter; test_keypoints
constexpr double blur_parts = 6.0;  // [1] derived: of its radius: squares of 5 pixels, as of Calonder et al. (2010); test_keypoints
constexpr double largest_zoom = 2.0;  // [1] budget: of the window, for what is nearer or farther than usual; test_keypoints
constexpr double pair_spread = 0.4;  // [radius] derived: of the places that are compared, the standard deviation, as of Calonder et al. (2010); test_keypoints
constexpr int most_differing = 64;  // [bits] derived: of 256, of the same corner: chance makes 128, by 8 less once in 10^15; test_keypoints
constexpr double clearly_nearest = 0.9;  // [1] tuned: distance of the nearest descriptor by the second's, at most; test_keypoints
constexpr int num_trials = 3000;  // [motions] budget: of three matches each: where a tenth is right, three are once in 1000; test_keypoints
constexpr double match_tolerance = 0.02;  // [depth] budget: of a match, about a motion that is where a registration begins; test_keypoints
constexpr double least_lever = 0.05;  // [depth] derived: between three matches that make a motion: what they err by turns it; test_keypoints
constexpr std::size_t least_matches = 8;  // [matches] derived: of one motion: three make it, and chance brings no five others; test_keypoints

}  // namespace nacre::keypoints_limits
// clang-format on
