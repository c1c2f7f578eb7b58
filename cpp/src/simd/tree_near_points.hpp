// What may be near a single place.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"
#include "simd/tree_layout.hpp"

namespace nacre::simd {

inline int lowest_bit(unsigned mask) {
#if defined(_MSC_VER) && !defined(__clang__)
  int bit = 0;
  for (; (mask & 1U) == 0; mask >>= 1) ++bit;
  return bit;
#else
  return __builtin_ctz(mask);
#endif
}

// The boxes of a group that are within a squared distance, in T, of a place: writes first_number + lane and the squared
// distance of each, the nearest last, and returns how many. There is room for 16 more.
template <class T>
using NearBoxes = int(const BoxGroup<T>& group, const T* place, T limit, uint32_t first_number, uint32_t* numbers,
                      T* d2);
NACRE_DECLARE_KERNEL(NearBoxes<float>, near_boxes_f32)
NACRE_DECLARE_KERNEL(NearBoxes<double>, near_boxes_f64)

// Which points of a block are, in bits.
template <class T>
using PointDistances = unsigned(const PointBlock<T>& block, const T* place, T limit);
NACRE_DECLARE_KERNEL(PointDistances<float>, point_distances_f32)
NACRE_DECLARE_KERNEL(PointDistances<double>, point_distances_f64)

constexpr int most_near_points = 1024;

// Where all points are that are within a radius, and some that are hardly beyond it. Returns how many, or -1 where they
// are more than `most`, which is up to most_near_points, or the radius is beyond what floats can do. `slots` has room
// for 16 more.
template <class T>
using NearPoints = int(const BlockTreeView<T>& tree, const double* place, double radius2, int most, uint32_t* slots);
NACRE_DECLARE_KERNEL(NearPoints<float>, near_points_f32)
NACRE_DECLARE_KERNEL(NearPoints<double>, near_points_f64)

}  // namespace nacre::simd
