// What kernels share that answer 16 queries at a time: queries close together see nearly the same points, so that one
// walk down the tree collects them for all.
//
// All filtering is in float, in coordinates of the group's own: from its centre, in a unit that makes the square of the
// search radius about 2^20. Their rounding is then a few parts in 10^7 of the radius wherever the points are, and
// `margin` bounds what it does to squared distances.
#pragma once

#include <float.h>
#include <math.h>

#include "simd/move_lanes.hpp"
#include "simd/tree_layout.hpp"

namespace nacre::simd::NACRE_ISA {

constexpr int group_queries = 16;
constexpr int most_candidates = 1024;  // their numbers take 10 bits of a key
constexpr int most_near = 128;         // candidates within the radius of one query
constexpr int32_t no_candidate = INT32_MAX;

struct LocalQueries {
  float radius2;  // of the search
  float reach2;   // beyond this from the queries' box, boxes and points are out
  float margin;   // local squared distances up to radius2 are off by less
  float half[3];  // of the queries' box, about 0
  alignas(64) float q[3][group_queries];
};

template <class T>
struct GroupFrame : LocalQueries {
  T origin[3], scale;  // local = (p - origin) * scale, the scale a power of 2
};

// The power of 2 that brings a square to 2^19 or up to four times that.
NACRE_INLINE double scale_for(double square) {
  int64_t bits;
  memcpy(&bits, &square, sizeof bits);
  const int64_t exponent = (bits >> 52) - 1023;  // square = 2^exponent to below twice that
  bits = (1023 + ((20 - exponent) >> 1)) << 52;
  double scale;
  memcpy(&scale, &bits, sizeof scale);
  return scale;
}

template <class T>
NACRE_INLINE bool is_in_range(double square) {
  constexpr bool is_double = sizeof(T) == 8;
  return square > (is_double ? 1e-280 : 1e-60) && square < (is_double ? 1e280 : 1e60);
}

// Every local coordinate within reach has an error of at most 2 units in the last place of half + radius; an error e of
// a distance is one of 2 d e + e^2 of its square.
template <class T>
NACRE_INLINE void set_reach(double radius2, float squared_half, GroupFrame<T>& frame) {
  frame.radius2 = static_cast<float>(radius2);
  const float radius = sqrtf(frame.radius2), extent = sqrtf(squared_half) + 2.0F * radius;
  const float error = 2.5e-7F * extent, reach = radius + 1e-6F * extent;
  frame.reach2 = reach * reach;
  frame.margin = (2.0F * radius + error) * error + 3e-7F * frame.radius2;
}

// Through memory: GCC 12 takes double(float(x)) for x in vectors.
NACRE_INLINE void round_to(double value, float& rounded) {
  volatile float memory = static_cast<float>(value);
  rounded = memory;
}
NACRE_INLINE void round_to(double value, double& rounded) { rounded = value; }

// Lays out the frame of the first queries; false where radius2 is beyond what the kernels handle.
template <class T>
NACRE_INLINE bool make_frame(const double (&queries)[3][group_queries], int size, double radius2,
                             GroupFrame<T>& frame) {
  if (!is_in_range<T>(radius2)) return false;
  const double scale = scale_for(radius2);
  float squared_half = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    double q[group_queries], lo[8], hi[8];
    for (int i = 0; i < group_queries; ++i) q[i] = queries[axis][i < size ? i : 0];
    for (int i = 0; i < 8; ++i) {
      lo[i] = q[i] < q[i + 8] ? q[i] : q[i + 8];
      hi[i] = q[i] < q[i + 8] ? q[i + 8] : q[i];
    }
    for (int n = 4; n > 0; n /= 2) {
      for (int i = 0; i < n; ++i) {
        lo[i] = lo[i] < lo[i + n] ? lo[i] : lo[i + n];
        hi[i] = hi[i] > hi[i + n] ? hi[i] : hi[i + n];
      }
    }
    T origin;
    round_to(lo[0] + (hi[0] - lo[0]) / 2, origin);
    for (int i = 0; i < group_queries; ++i) {
      frame.q[axis][i] = static_cast<float>((q[i] - static_cast<double>(origin)) * scale);
    }
    const auto to_lo = static_cast<float>((static_cast<double>(origin) - lo[0]) * scale);
    const auto to_hi = static_cast<float>((hi[0] - static_cast<double>(origin)) * scale);
    const float half = to_lo > to_hi ? to_lo : to_hi;
    frame.origin[axis] = origin;
    frame.half[axis] = half;
    squared_half += half * half;
  }
  set_reach(radius2 * scale * scale, squared_half, frame);
  frame.scale = static_cast<T>(scale);
  return squared_half < 1e30F;
}

// Lays out the frame of one query.
template <class T>
NACRE_INLINE bool make_frame(const double* query, double radius2, GroupFrame<T>& frame) {
  if (!is_in_range<T>(radius2)) return false;
  const double scale = scale_for(radius2);
  float squared_half = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    round_to(query[axis], frame.origin[axis]);
    frame.q[axis][0] = static_cast<float>((query[axis] - static_cast<double>(frame.origin[axis])) * scale);
    frame.half[axis] = fabsf(frame.q[axis][0]);
    squared_half += frame.half[axis] * frame.half[axis];
  }
  set_reach(radius2 * scale * scale, squared_half, frame);
  frame.scale = static_cast<T>(scale);
  return squared_half < 1e30F;
}

// What to collect of a point besides its place.
enum class Position { local, own, none };

// In order of their places in the tree.
struct Candidates {
  alignas(64) float p[3][most_candidates + 16];
  alignas(64) int32_t slot[most_candidates + 16];
  int count;
};

NACRE_INLINE F32 local_lanes(const float* p, float origin, float scale) {
  return (load(p) - broadcast(origin)) * broadcast(scale);
}
NACRE_INLINE F32 local_lanes(const double* p, double origin, double scale) {
#if defined(__AVX512F__) && defined(__AVX512VL__)
  const __m512d o = _mm512_set1_pd(origin), s = _mm512_set1_pd(scale);
  const __m256 a = _mm512_cvtpd_ps(_mm512_mul_pd(_mm512_sub_pd(_mm512_loadu_pd(p), o), s));
  const __m256 b = _mm512_cvtpd_ps(_mm512_mul_pd(_mm512_sub_pd(_mm512_loadu_pd(p + 8), o), s));
  return {_mm512_insertf32x8(_mm512_castps256_ps512(a), b, 1)};
#else
  float local[lanes];
  for (int i = 0; i < lanes; ++i) local[i] = static_cast<float>((p[i] - origin) * scale);
  return load(local);
#endif
}

// Collects the points within reach of the queries' box; false where they are more than `most`.
template <Position position, class T>
NACRE_INLINE bool collect(const BlockTreeView<T>& tree, const GroupFrame<T>& frame, Candidates& out,
                          int most = most_candidates) {
  constexpr int most_boxes = 512;
  int32_t lists[2][most_boxes + group_boxes];
  const F32 reach2 = broadcast(frame.reach2), zero = broadcast(0.0F);
  F32 half[3];
  for (int axis = 0; axis < 3; ++axis) half[axis] = broadcast(frame.half[axis]);

  int32_t *boxes = lists[0], *below = lists[1];
  int num_boxes = 1;
  boxes[0] = 0;
  for (int level = tree.num_levels - 1; level >= 0; --level) {
    int num_below = 0;
    for (int i = 0; i < num_boxes; ++i) {
      const BoxGroup<T>& group = tree.levels[level][boxes[i]];
      for (int lane = 0; lane < group_boxes; lane += lanes) {
        F32 d2 = zero;
        for (int axis = 0; axis < 3; ++axis) {
          const F32 lo = local_lanes(group.lo[axis] + lane, frame.origin[axis], frame.scale);
          const F32 hi = local_lanes(group.hi[axis] + lane, frame.origin[axis], frame.scale);
          const F32 gap = max(max(lo, zero - hi) - half[axis], zero);
          d2 += gap * gap;
        }
        const Mask near = d2 <= reach2;
        store_chosen(below + num_below, near, lane_numbers() + broadcast(boxes[i] * group_boxes + lane));
        num_below += simd::NACRE_ISA::count(near);
      }
      if (num_below > most_boxes || num_below > most) return false;
    }
    int32_t* const swap = boxes;
    boxes = below;
    below = swap;
    num_boxes = num_below;
  }

  int n = 0;
  for (int i = 0; i < num_boxes; ++i) {
    const PointBlock<T>& block = tree.blocks[boxes[i]];
    for (int lane = 0; lane < block_points; lane += lanes) {
      F32 p[3], d2 = zero;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = local_lanes(block.p[axis] + lane, frame.origin[axis], frame.scale);
        const F32 gap = max(abs(p[axis]) - half[axis], zero);
        d2 += gap * gap;
      }
      const Mask near = (d2 <= reach2) & (p[0] == p[0]);
      for (int axis = 0; axis < 3; ++axis) {
        if constexpr (position == Position::local) store_chosen(out.p[axis] + n, near, p[axis]);
        if constexpr (position == Position::own) store_chosen(out.p[axis] + n, near, load(block.p[axis] + lane));
      }
      store_chosen(out.slot + n, near, lane_numbers() + broadcast(boxes[i] * block_points + lane));
      n += simd::NACRE_ISA::count(near);
    }
    if (n > most) return false;
  }
  out.count = n;
  if constexpr (position == Position::local) {
    for (int lane = 0; lane < 16; lane += lanes) store(out.p[0] + n + lane, broadcast(1e18F));
  }
  return true;
}

}  // namespace nacre::simd::NACRE_ISA
