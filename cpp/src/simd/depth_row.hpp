// What the kernels know of the planar image (depth/inverse_depth_image.hpp).
#pragma once

#include <stddef.h>

namespace nacre::simd {

// constant + x (linear + x square)
struct Quadratic {
  float constant, linear, square;
};

constexpr int chunk = 64;                 // pixels that are written together
constexpr int largest_normal_window = 5;  // pixels on each side

// One row of it; NaN where there is no measurement.
struct PlanarRow {
  const float* values;  // NaN for largest_normal_window pixels beyond every side, and 31 more beyond the row's end
  ptrdiff_t stride;     // from row to row
  int width;
  bool is_inverse;  // inverse depth
};

}  // namespace nacre::simd
