// Which pixels of a row are kept, one byte a pixel (1 = kept).
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "simd/depth_row.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

// How many pixels of a row went, by the first reason that applies to each.
struct KeepCounts {
  int32_t num_invalid, num_out_of_range, num_masked, num_edge, num_slanted;
};

// direction_x: of the rays, NaN where a pixel sees nothing. mask: null where every pixel counts. marks: edge_row.hpp.
struct KeepRow {
  const float *depth, *direction_x;
  const uint8_t *mask, *marks;
  float min_depth, max_depth;
  int width;
};
using KeepPixels = KeepCounts(const KeepRow& row, uint8_t* keep);
NACRE_DECLARE_KERNEL(KeepPixels, keep_pixels)

// Keeps pixels with at least `least` kept ones in their window of 5 x 5, themselves included. Around the image `keep`
// is 0 for two pixels.
using RemoveIsolated = void(const uint8_t* keep, ptrdiff_t stride, const uint8_t* least, int width,
                            uint8_t* still_kept);
NACRE_DECLARE_KERNEL(RemoveIsolated, remove_isolated)

// The values of kept pixels, NaN elsewhere; returns how many are kept.
using SelectKept = int(const float* values, const uint8_t* keep, int width, float* kept);
NACRE_DECLARE_KERNEL(SelectKept, select_kept)

// Bit u % 64 of word u / 64 says of pixel u: it is kept; it is connected to its left neighbour; to the one above. Two
// kept pixels a, b are connected where |a - b| <= noise(a) + slant(a).
struct Links {
  uint64_t *kept, *left, *above;
};
struct LinkRule {
  Quadratic noise, slant;
};
// `keep` has the stride `keep_stride`; before the first pixel and above the first row it is 0.
using LinkPixels = void(const PlanarRow& row, const LinkRule& rule, const uint8_t* keep, ptrdiff_t keep_stride,
                        const Links& links);
NACRE_DECLARE_KERNEL(LinkPixels, link_pixels)

}  // namespace nacre::simd
