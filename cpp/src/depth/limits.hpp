// Numbers that decide which pixels are measurements, and how noisy they are.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

// clang-format off
namespace nacre::depth_limits {

constexpr float lateral_sigma = 0.8F;  // [pixel] derived: a pixel looks aside (Nguyen et al. 2012, fig. 7); test_depth
constexpr float slope_sigma = 0.07F;  // [1] tuned: a normal's window grows until its slope is this certain; test_frame
constexpr float least_filled = 0.4F;  // [1] tuned: part of a normal's window that must be measured; test_frame
constexpr float least_spread = 0.02F;  // [1] tuned: of a full window's squared spread, both ways; test_frame
constexpr float gate_slope = 5.67F;  // [1] derived: neighbours of one surface: a slant of 80 degrees; test_frame
constexpr double noise_quantile = 0.4;  // [1] tuned: of residuals: edges leave more over than noise; test_noise
constexpr double least_noise = 1e-3;  // [pixel] tuned: sigma of a clean image, in sizes of a pixel; test_noise
constexpr double unknown_noise = 0.1;  // [pixel] tuned: sigma of an orthographic image that shows nothing; test_noise
constexpr std::int64_t least_witnesses = 40;  // [1] tuned: windows of an image, or of some depth, that tell the noise; gaps that are dots of a pattern; pixels of one value that are none; test_noise, test_saturation
constexpr double least_stepped = 0.1;  // [1] tuned: part of windows that cross plateaus of depth; test_noise
constexpr float largest_step = 3.0F;  // [pixel] derived: orthographic: a larger step of depth is an edge; test_noise
constexpr double smooth_left = 0.1192;  // [1] derived: of smooth noise, what 7 x 7 fits leave over; docs/algorithms/noise.md
constexpr double smooth_bent = 0.0145;  // [1] derived: of smooth noise, what second differences see; docs/algorithms/noise.md
constexpr double independent = 0.95;  // [1] tuned: bends by fits above which noise is independent; test_noise
constexpr double most_shared = 0.85;  // [1] tuned: part of the variance that pixels may share; test_noise
constexpr double most_frames = 100.0;  // [frames] tuned: a frame counts at least so much: drift is followed; test_noise
constexpr double prior_weight = 0.01;  // [1] tuned: of the prior's curve against all that was measured; test_noise
constexpr double nearest_bin = 0.015625;  // [m] derived: where the bins of depth begin, nearer than any camera measures; test_noise
constexpr double bins_per_octave = 3.0;  // [1] derived: of depth; test_noise
constexpr float systematic_growth = 0.0015F;  // [1/m^2] tuned: systematic error z^3 of structured light; teddy, rpy
constexpr std::int64_t probed_rows = 8;  // [pixel] budget: between rows that tell the unit of depth, and whether there are gaps; test_coarse_depth, test_gaps
constexpr double unit_quantile = 0.1;  // [1] tuned: of the steps between neighbours: one unit; test_coarse_depth
constexpr float unit_tolerance = 0.1F;  // [unit] derived: to which steps are multiples of the unit; test_coarse_depth
constexpr double least_multiples = 0.99;  // [1] tuned: part of the steps that are; test_coarse_depth
constexpr std::int64_t least_levels = 8;  // [levels] tuned: two walls are no unit, nor one a largest value; test_coarse_depth, test_depth
constexpr int farthest_pixels = 16;  // [pixel] budget: from one measured pixel to the next, what is farther is a hole; test_pixel_binning
constexpr double most_worked_on = 100000.0;  // [pixels] budget: measured, of the first image; pixels are averaged where there are more; test_pixel_binning
constexpr double least_saturated = 0.005;  // [1] tuned: part of an image that has its largest value; test_saturation
constexpr float saturation_gap = 0.1F;  // [1] tuned: of the largest value: fewer lie between; test_saturation
constexpr float far_saturation = 3.0F;  // [1] tuned: of the median of the rest: a nearer largest value may be a flat wall; test_saturation
constexpr float nearest_median = 0.05F;  // [m] derived: nearer medians: a wrong depth_scale; test_depth
constexpr float farthest_median = 50.0F;  // [m] derived: farther medians: a wrong depth_scale; test_depth
constexpr std::int64_t most_probes = 8192;  // [pixels] budget: that tell an image's median depth; test_depth
constexpr double most_blocks = 19200.0;  // [blocks] budget: of pixels that a view is averaged to, to calibrate depth; test_depth_calibration
constexpr int most_views = 24;  // [views] budget: that depth is calibrated by; test_depth_calibration
constexpr double least_turn = 0.1;  // [rad] tuned: between views that are compared; a tilt that turns what it tilts by more is none; test_depth_calibration
constexpr double most_turn = 0.6;  // [rad] tuned: between views that are compared; test_depth_calibration
constexpr int most_calibration_steps = 16;  // [iterations] budget: of Gauss and Newton; test_depth_calibration
constexpr double largest_stretch_step = 0.1;  // [1] budget: of the stretch, in one iteration; test_depth_calibration
constexpr double least_part_left = 1e-4;  // [1] derived: of the information, that poses leave; rounding leaves less; test_depth_calibration
constexpr double at_rest = 0.1;  // [sigma] derived: a smaller step changes nothing; test_depth_calibration
constexpr std::int64_t least_matches = 200;  // [blocks] tuned: that two views must share; test_depth_calibration
constexpr double largest_block_step = 0.1;  // [1] tuned: of the depth, across two blocks of one surface; test_depth_calibration
constexpr double sure_sigmas = 5.0;  // [sigma] derived: of a Gaussian: an error of depth is beyond chance; test_depth_calibration
constexpr double least_tilt = 0.002;  // [1/m] derived: noise of one pixel's inverse depth, structured light; test_depth_calibration
constexpr double least_focal_error = 0.04;  // [1] tuned: calibrated cameras show up to 0.03; test_depth_calibration
constexpr double least_radial = 0.5;  // [1] derived: between depth along the axis, 0, and along the rays, 1; test_depth_calibration
constexpr float largest_correction = 0.5F;  // [1] derived: of the depth: no calibration reaches; test_depth_calibration

}  // namespace nacre::depth_limits
// clang-format on
