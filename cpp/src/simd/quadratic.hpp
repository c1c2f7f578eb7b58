#pragma once

#include "simd/depth_row.hpp"
#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {

NACRE_INLINE F32 evaluate(const Quadratic& q, F32 x) {
  return broadcast(q.constant) + x * (broadcast(q.linear) + x * broadcast(q.square));
}

}  // namespace nacre::simd::NACRE_ISA
