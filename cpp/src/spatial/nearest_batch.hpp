// The nearest point of each of many queries, for loops that ask again and again: in float, 16 queries at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "simd/tree_nearest_point.hpp"
#include "spatial/bvh16.hpp"

namespace nacre {

constexpr std::uint32_t no_slot = std::numeric_limits<std::uint32_t>::max();

// Queries array by array. What comes in as `slots`, the answers to queries near these or no_slot, only makes the search
// shorter. The answers: the nearest point's place in the tree, no_slot where none is within the largest distance, and
// the squared distance in float. Of equally near points the one that comes first in the tree. Optional: `next` gets
// squared distances that no other point is below, so that the answer stays while neither moves by half the difference.
struct NearestPoints {
  const float *x, *y, *z;
  std::uint32_t* slots;
  float* squared_distances;
  float* next;
};

// Answers queries [begin, end), which should be in an order in which each is near the one before. No answer depends on
// which queries are asked together.
void find_nearest_points(const BlockTree<float>& tree, const NearestPoints& queries, std::int64_t begin,
                         std::int64_t end, double max_distance);

}  // namespace nacre
