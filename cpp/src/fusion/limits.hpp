// Numbers that decide which pixels speak of a point, and when a point comes and goes.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>

// clang-format off
namespace nacre::fusion_limits {

constexpr float least_facing = 0.1F;  // [cosine] tuned: surfaces seen at a smaller one are not judged; test_fusion
constexpr float least_weight = 0.05F;  // [measurements] tuned: frontal: less observation is none; test_fusion
constexpr float support_sigmas = 6.0F;  // [sigma] tuned: radius of pixels that speak of a point; bunny12
constexpr float least_support = 3.0F;  // [pixel] tuned: at least; bunny12
constexpr float largest_support = 4.0F;  // [pixel] budget: at most; bunny12
constexpr float insertion_pixels = 3.0F;  // [pixels] tuned: that a new point stands on, from the front; bunny12
constexpr float insertion_weight = 1.0F;  // [measurements] tuned: and at least; bunny12
constexpr int squares_across = 8;  // [1] budget: of the index of pixels, in a reach; benchmarks/run.py
constexpr std::size_t sigma_probes = 5000;  // [pixels] budget: that tell a frame's median noise; test_fusion
constexpr int layer_levels = 4;  // [1] budget: of spacing, each twice the one before; test_correction
constexpr std::size_t exposure_blocks = 8;  // [blocks] budget: of points, one of which tells how bright a frame is; test_exposure
constexpr std::size_t least_exposure_points = 100;  // [points] derived: whose median ratio is sure to a tenth of their scatter; test_exposure
constexpr float darkest_color = 16.0F;  // [grey levels] derived: below it rounding is more than 3 %; test_exposure
constexpr float brightest_color = 239.0F;  // [grey levels] derived: as far from the other end, where sensors saturate; test_exposure
constexpr std::size_t points_per_free = 4;  // [1] budget: of a model, for each that there is room for beside them; test_point_arrays
constexpr double behind_sigmas = 12.0;  // [sigma] derived: behind all that is measured nothing is said of a point: noise_sigmas twice, and as much again; test_block_index
constexpr double behind_spacings = 4.0;  // [spacing] derived: likewise: more than surface_spacings; test_block_index
constexpr double behind_pixels = 12.0;  // [pixels] derived: likewise: largest_support twice, and as much again; test_block_index

}  // namespace nacre::fusion_limits
// clang-format on
