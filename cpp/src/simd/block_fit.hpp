// How far the points of blocks reach.
#pragma once

#include <stdint.h>

#include "isa.hpp"

namespace nacre::simd {

// The lowest and highest coordinates in each of 16 blocks of 16 points, one after the other. Points of 1e18 and more do
// not count.
struct BlockFit {
  float lower[3][16], upper[3][16];
};

using FitBlocks = void(const float* const* coordinates, BlockFit& fit);
NACRE_DECLARE_KERNEL(FitBlocks, fit_blocks)

}  // namespace nacre::simd
