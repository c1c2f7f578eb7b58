// The nearest point of each of 16 queries in float.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"
#include "simd/tree_layout.hpp"

namespace nacre::simd {

// Queries that are close together.
struct PointGroup {
  int size;
  float x[16], y[16], z[16];
  float radius2;               // to search; its square
  uint32_t slot[16];           // out: the nearest point's place in the tree
  float squared_distance[16];  // out: infinite where no point is within the radius
  float next[16];              // out: the squared distance that no other point is below
  int num_candidates;          // out, of several queries: what each was compared with
  bool crowded;                // out: too many points within the radius, nothing else is set
};

// The least (x - p)^2 + (y - q)^2 + (z - r)^2 in float, of equal ones the point that comes first in the tree.
using NearestPoints = void(const BlockTreeView<float>& tree, PointGroup& group);
NACRE_DECLARE_KERNEL(NearestPoints, nearest_points)

}  // namespace nacre::simd
