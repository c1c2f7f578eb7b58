// The edge tests of a row of the planar image.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "simd/depth_row.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

constexpr uint8_t edge_mark = 1, slanted_mark = 2;

// Limits of second differences (bend) and first differences (step) between neighbours, given the value; lateral: per
// slope of the surface.
struct EdgeLimits {
  Quadratic bend_noise, bend_crease, step_noise, step_slant;
  float bend_lateral, step_lateral;
};

// The surface's change per pixel, by which a pixel errs that looks aside: between others, and beside missing ones,
// where looking aside is looking past the surface. Readable 15 beyond the row's end.
struct SlopeRow {
  const float *inside, *at_rim;
};

// Marks pixels where a second difference in one of the four directions through the pixel exceeds its limit; at a rim
// the pixel is held against the plane through its two inner neighbours: where it is farther, to the slope of a rim. And
// pixels where both first differences do, or the slope of the surface as a whole.
using MarkEdges = void(const PlanarRow& row, const EdgeLimits& limits, const SlopeRow& slope, uint8_t* marks);
NACRE_DECLARE_KERNEL(MarkEdges, mark_edges)

// Marks pixels where the gradient of the depth, by Sobel's 3 x 3 operator, exceeds a limit (squared, of 8 times the
// gradient) or is unknown (NaN). Rows are readable one pixel to the left and 16 beyond their end.
struct DepthRows {
  const float *above, *here, *below;
  int width;
};
using MarkGradients = void(const DepthRows& rows, float squared_limit, uint8_t* marks);
NACRE_DECLARE_KERNEL(MarkGradients, mark_gradients)

// Each pixel's marks, with those of its four neighbours: one byte a pixel. Around the image `marks` is 0.
using DilateMarks = void(const uint8_t* marks, ptrdiff_t stride, int width, uint8_t* dilated);
NACRE_DECLARE_KERNEL(DilateMarks, dilate_marks)

}  // namespace nacre::simd
