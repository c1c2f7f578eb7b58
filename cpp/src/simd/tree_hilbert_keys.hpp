// Where points lie along a Hilbert curve.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int curve_bits = 30;  // 10 an axis
constexpr uint32_t no_key = 0xFFFFFFFF;

// A box of points; infinity to -infinity without any.
template <class T>
struct CurveBox {
  T lo[3], hi[3];
};

// A cube of 2^10 cells a side: a point's cell is (p - lo) * cells_per_unit, rounded down.
template <class T>
struct CurveCube {
  T lo[3], cells_per_unit;
};

// Widens the box by those of `count` rows whose three coordinates are finite.
template <class T>
using WidenBox = void(const T* points, int64_t count, CurveBox<T>& box);
NACRE_DECLARE_KERNEL(WidenBox<float>, widen_box_f32)
NACRE_DECLARE_KERNEL(WidenBox<double>, widen_box_f64)

// The number of each point's cell along the curve, from 0 to 2^curve_bits - 1; no_key where a coordinate is not finite.
template <class T>
using CurveKeys = void(const T* points, int64_t count, const CurveCube<T>& cube, uint32_t* keys);
NACRE_DECLARE_KERNEL(CurveKeys<float>, curve_keys_f32)
NACRE_DECLARE_KERNEL(CurveKeys<double>, curve_keys_f64)

// The key of one point, which is finite.
template <class T>
using CurveKey = uint32_t(const T* point, const CurveCube<T>& cube);
NACRE_DECLARE_KERNEL(CurveKey<float>, curve_key_f32)
NACRE_DECLARE_KERNEL(CurveKey<double>, curve_key_f64)

}  // namespace nacre::simd
