// How far the points of blocks reach.
#pragma once

#include <stdint.h>

#include "isa.hpp"

namespace nacre::simd {

// For 16 blocks of 16 points, one after the other: the lowest and highest coordinate of each, and the largest squared
// distance from the blocks' origins. Points of 1e18 and more do not count; every block has a point that does.
struct BlockFit {
  float lower[3][16], upper[3][16];
  float squared_radius[16];
};

using FitBlocks = void(const float* const* coordinates, BlockFit& fit);
NACRE_DECLARE_KERNEL(FitBlocks, fit_blocks)

}  // namespace nacre::simd
