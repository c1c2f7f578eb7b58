// Quadratic surfaces fitted to a row of windows of 7 x 7 pixels.
#pragma once

#include <stddef.h>

#include "isa.hpp"

namespace nacre::simd {

constexpr int fit_radius = 3;  // windows of 7 x 7 pixels
constexpr int fit_step = 5;    // from window to window

// Of each window: the standard deviation of the values about the surface, and the surface's slope per pixel (both NaN
// where a pixel is missing); the smallest step from one plateau to the next along its central row and column, 0 where
// there are not both: plateaus, and steps. All in the units of the values.
struct WindowRow {
  float *residual, *slope, *step;
};
// `values` is the centre of the first of `count` windows.
using FitWindows = void(const float* values, ptrdiff_t stride, int count, const WindowRow& out);
NACRE_DECLARE_KERNEL(FitWindows, fit_windows)

}  // namespace nacre::simd
