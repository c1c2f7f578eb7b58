// Quadratic surfaces fitted to a row of windows of 7 x 7 pixels.
#pragma once

#include <stddef.h>

#include "simd/depth_row.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int fit_radius = 3;  // windows of 7 x 7 pixels
constexpr int fit_step = 5;    // from window to window

// The unit of the noise, given the value, and the value's change per pixel on a slope of 1. A step that is larger, in
// such units or in pixels, is an edge.
struct WindowRule {
  Quadratic unit, unit_slope;
  float max_step, max_step_pixels;
};

// Of each window: the standard deviation of the values about the surface; the same from the second differences along
// the central row and column, which see nothing of what neighbours have in common; the change per pixel on a slope of
// 1; the smallest step from one plateau to the next along the central row and column, NaN where there are not both:
// plateaus, and steps (all four in units of the noise); the surface's slope per pixel. NaN where a pixel is missing.
struct WindowRow {
  float *residual, *roughness, *pixel, *step, *slope;
};
// `values` is the centre of the first of `count` windows; 100 values beyond the last are read, the next row's perhaps.
using FitWindows = void(const float* values, ptrdiff_t stride, int count, const WindowRule& rule, const WindowRow& out);
NACRE_DECLARE_KERNEL(FitWindows, fit_windows)

}  // namespace nacre::simd
