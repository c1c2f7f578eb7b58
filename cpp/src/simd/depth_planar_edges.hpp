// Marked pixels that lie on a surface beside them after all.
#pragma once

#include <stdint.h>

#include "simd/depth_row.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int side_depth = 3, side_reach = 2;  // pixels away from the pixel, and to each side of that direction

struct PlanarRule {
  Quadratic sigma;     // of the value, given the value
  Quadratic steepest;  // slope of a surface, per pixel
  float squared_sigmas;
};

// The marks of edge_row.hpp, of rows `stride` apart, readable side_depth beyond every side of the image. The pixels in
// which `first_marks` has the slanted mark stay marked.
struct PlanarMarks {
  const uint8_t *marks, *first_marks;
  ptrdiff_t stride;
};

// The marks of a row, without those of pixels that are near enough to the plane through the unmarked pixels beside
// them: of the windows of side_depth x (2 side_reach + 1) pixels to the left, to the right, above and below, those with
// an unmarked pixel next to the marked one, at least half full, and no rougher than noise; and of these the one whose
// plane is the most certain at the marked pixel.
using KeepPlanarPixels = void(const PlanarRow& row, const PlanarRule& rule, const PlanarMarks& marks,
                              uint8_t* left_marked);
NACRE_DECLARE_KERNEL(KeepPlanarPixels, keep_planar_pixels)

}  // namespace nacre::simd
