// How far the points of blocks reach.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

// The lowest and highest coordinates in each of 16 blocks; block b has the points starts[b] to starts[b + 1] - 1, at
// least one.
struct BlockFit {
  float lower[3][16], upper[3][16];
};

using FitBlocks = void(const float* const* coordinates, const int32_t* starts, BlockFit& fit);
NACRE_DECLARE_KERNEL(FitBlocks, fit_blocks)

}  // namespace nacre::simd
