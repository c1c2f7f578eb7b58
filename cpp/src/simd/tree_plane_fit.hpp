// Planes through the neighbourhoods of 16 points at a time.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"
#include "simd/tree_layout.hpp"

namespace nacre::simd {

// Neighbours of 16 points by their places in the tree, `stride` for each; point i has counts[i] of them.
struct Neighborhoods {
  double p[3][16];
  const uint32_t* slots;
  int stride;
  int counts[16];
};

// The direction of least variance of each neighbourhood, unit length, to an arbitrary side; NaN where it has fewer than
// three points, is on a line or fills space.
template <class T>
using FitPlanes = void(const BlockTreeView<T>& tree, const Neighborhoods& neighborhoods, double (&normals)[3][16]);
NACRE_DECLARE_KERNEL(FitPlanes<float>, fit_planes_f32)
NACRE_DECLARE_KERNEL(FitPlanes<double>, fit_planes_f64)

}  // namespace nacre::simd
