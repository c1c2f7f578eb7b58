// The k nearest points of 16 queries at a time.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"
#include "simd/tree_layout.hpp"

namespace nacre::simd {

constexpr int most_group_neighbors = 64;

// What is asked of every query, and where the answers go: k entries for each row of the caller's.
struct NearestTask {
  int k;  // up to most_group_neighbors
  double max_distance2;
  int64_t missing;  // the index where fewer are found
  int64_t* indices;
  double* distances;  // or, where that is null,
  float* float_distances;
};

// The same for those who go on with the neighbours: their places in the tree, k entries for each row, and how many.
struct NearestSlotsTask {
  int k;
  double max_distance2;
  uint32_t* slots;
  int* counts;
};

struct QueryGroup {
  double p[3][16];
  uint32_t row[16];
  int size;          // queries without an answer
  double radius2;    // to search; its square
  double farthest2;  // out: the largest squared distance to a k-th neighbour found
  bool crowded;      // out: too many points within the radius of some query
};

// Answers the queries that the radius is large enough for, and closes their gaps: the others are the first `size`.
// Answers are exact: squared distances in double, ties by the smaller id. Queries that float cannot decide stay.
template <class T>
using NearestGroup = void(const BlockTreeView<T>& tree, const NearestTask& task, QueryGroup& group);
NACRE_DECLARE_KERNEL(NearestGroup<float>, nearest_group_f32)
NACRE_DECLARE_KERNEL(NearestGroup<double>, nearest_group_f64)

template <class T>
using NearestSlots = void(const BlockTreeView<T>& tree, const NearestSlotsTask& task, QueryGroup& group);
NACRE_DECLARE_KERNEL(NearestSlots<float>, nearest_slots_f32)
NACRE_DECLARE_KERNEL(NearestSlots<double>, nearest_slots_f64)

}  // namespace nacre::simd
