// The memory layout of the k-d tree and its hot kernels.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#endif
#ifdef _MSC_VER
#include <intrin.h>
#endif

namespace nacre {

constexpr int block_points = 16;
constexpr int group_boxes = 8;

// 16 points that are close together. Lanes beyond the last point are NaN, which no comparison lets through.
template <class T>
struct alignas(64) PointBlock {
  using Lanes = Eigen::Array<T, block_points, 1>;
  Lanes p[3];  // x, y, z
  std::uint32_t id[block_points];

  // |q - p|^2
  Lanes squared_distances(const T* q) const {
    return (q[0] - p[0]).square() + (q[1] - p[1]).square() + (q[2] - p[2]).square();
  }
};

// The bounding boxes of 8 consecutive children (blocks, or groups of boxes), first_child onwards, and their points'
// smallest ids. Lanes beyond the last child are not set in `used`.
template <class T>
struct alignas(64) BoxGroup {
  using Lanes = Eigen::Array<T, group_boxes, 1>;
  Lanes lo[3], hi[3];
  std::uint32_t first_id[group_boxes];
  std::uint32_t first_child;
  unsigned used;

  // The sum over the axes of max(0, lo - q, q - hi)^2.
  Lanes squared_distances(const T* q) const {
    return (lo[0] - q[0]).max(q[0] - hi[0]).max(T(0)).square() + (lo[1] - q[1]).max(q[1] - hi[1]).max(T(0)).square() +
           (lo[2] - q[2]).max(q[2] - hi[2]).max(T(0)).square();
  }
};

// Bit i is set where values[i] <= limit.
template <class T, int N>
unsigned lanes_within(const Eigen::Array<T, N, 1>& values, T limit) {
  unsigned mask = 0;
  for (int i = 0; i < N; ++i) mask |= static_cast<unsigned>(values[i] <= limit) << i;
  return mask;
}

#if defined(__SSE2__) || defined(_M_X64)
template <int N>
unsigned lanes_within(const Eigen::Array<float, N, 1>& values, float limit) {
  unsigned mask = 0;
  for (int i = 0; i < N; i += 4) {
    const __m128 within = _mm_cmple_ps(_mm_loadu_ps(values.data() + i), _mm_set1_ps(limit));
    mask |= static_cast<unsigned>(_mm_movemask_ps(within)) << i;
  }
  return mask;
}

template <int N>
unsigned lanes_within(const Eigen::Array<double, N, 1>& values, double limit) {
  unsigned mask = 0;
  for (int i = 0; i < N; i += 2) {
    const __m128d within = _mm_cmple_pd(_mm_loadu_pd(values.data() + i), _mm_set1_pd(limit));
    mask |= static_cast<unsigned>(_mm_movemask_pd(within)) << i;
  }
  return mask;
}
#endif

inline int lowest_lane(unsigned mask) {
#ifdef _MSC_VER
  unsigned long lane;
  _BitScanForward(&lane, mask);
  return static_cast<int>(lane);
#else
  return __builtin_ctz(mask);
#endif
}

}  // namespace nacre
