// Sums over the points around each point of a block, weighted by their distance: the inner loop of consolidation.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int block_size = 16;  // points a block, boxes a node
constexpr int node_floats = 6 * block_size;
constexpr int most_levels = 8;

// Boxes around blocks, and around 16 such boxes each, up to one node. Node n of level l has the children 16 n to
// 16 n + 15 of level l - 1, of level 0 the blocks of these numbers; it holds their lower x, y, z, then their upper
// x, y, z, 16 each. A child that does not exist has a box from infinity to minus infinity.
struct BoxTree {
  const float* nodes[most_levels];
  int num_levels;
};

// Points in blocks of up to 16, relative to the origin of their block; 15 more than there are can be read. The unit of
// length is the one in which theta(r) = 2^(-r^2).
struct PairPoints {
  const float *x, *y, *z;
  const float* mass;      // null: all are 1
  const int32_t* starts;  // block b has the points starts[b] to starts[b + 1] - 1
  const double* origin;   // 3 a block
  const float* halves;    // 3 a block: how far its points reach from its origin along each axis
  BoxTree tree;
};

// The first `count` points of a block, relative to its origin; 16 are readable.
struct PairTargets {
  int count;
  const float *x, *y, *z;
  double origin[3];
  float lower[3], upper[3];  // box around them, where the origin of all blocks is
};

// The weight of a pair at distance r: theta(r) divided by a power of r, times the mass.
struct PairKernel {
  int decay;         // the power: 0, 1 or 2
  float reach2;      // pairs at this squared distance or farther have no weight; at most 126
  float skip2;       // pairs at this squared distance or nearer have no weight; -1: none is too near
  float softening2;  // decay 1 takes r as sqrt(r^2 + softening2)
};

// Which sums, w being the weight, d the offset from the target to the point.
enum class PairSums {
  mass,            // w
  mass_and_count,  // w; number of pairs that have a weight
  first,           // w; w d: x, y, z
  second           // w; w d: x, y, z; w d d^T: xx, xy, xz, yy, yz, zz
};

// sums[16 k + i]: sum k of target i, in the order above.
using SumPairs = void(const PairKernel& kernel, PairSums which, const PairTargets& targets, const PairPoints& points,
                      float* sums);
NACRE_DECLARE_KERNEL(SumPairs, sum_pairs)

// weights[16 b + j]: weight of the target and point j of the b-th block of the list; 0 where it has no such point.
using WeighPairs = void(const PairKernel& kernel, const PairTargets& targets, int target, const PairPoints& points,
                        const int32_t* blocks, int64_t num_blocks, float* weights);
NACRE_DECLARE_KERNEL(WeighPairs, weigh_pairs)

// The blocks whose boxes come within a squared distance of the targets' box, ascending: visit(context, block).
using VisitBlocks = void(float squared_distance, const PairTargets& targets, const BoxTree& tree,
                         void (*visit)(void* context, int32_t block), void* context);
NACRE_DECLARE_KERNEL(VisitBlocks, visit_blocks)

}  // namespace nacre::simd
