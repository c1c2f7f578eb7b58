#include "simd/tree_near_points.hpp"

#include "simd/tree_group_search.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

NACRE_INLINE unsigned lanes_within(const float* values, float limit) {
  unsigned mask = 0;
  for (int lane = 0; lane < 16; lane += lanes) mask |= bits(load(values + lane) <= broadcast(limit)) << lane;
  return mask;
}
NACRE_INLINE unsigned lanes_within(const double* values, double limit) {
  unsigned mask = 0;
#if defined(__AVX512F__) && defined(__AVX512VL__)
  const __m512d limits = _mm512_set1_pd(limit);
  mask = _mm512_cmp_pd_mask(_mm512_loadu_pd(values), limits, _CMP_LE_OQ);
  mask |= static_cast<unsigned>(_mm512_cmp_pd_mask(_mm512_loadu_pd(values + 8), limits, _CMP_LE_OQ)) << 8;
#else
  for (int lane = 0; lane < 16; ++lane) mask |= static_cast<unsigned>(values[lane] <= limit) << lane;
#endif
  return mask;
}

template <class T>
NACRE_INLINE void swap_with_last(int i, int n, uint32_t* numbers, T* d2) {
  const uint32_t number = numbers[n - 1];
  const T distance = d2[n - 1];
  numbers[n - 1] = numbers[i];
  d2[n - 1] = d2[i];
  numbers[i] = number;
  d2[i] = distance;
}

// The square is the sum over the axes of max(0, lo - q, q - hi)^2.
int near_boxes(const BoxGroup<float>& group, const float* place, float limit, uint32_t first_number, uint32_t* numbers,
               float* d2) {
  int n = 0, nearest = 0;
  float least = INFINITY;
  for (int lane = 0; lane < group_boxes; lane += lanes) {
    F32 sum = broadcast(0.0F);
    for (int axis = 0; axis < 3; ++axis) {
      const F32 q = broadcast(place[axis]);
      // NaN, of a box that does not exist and a query beyond floats, stays NaN and is not near.
      const F32 gap = max(broadcast(0.0F), max(load(group.lo[axis] + lane) - q, q - load(group.hi[axis] + lane)));
      sum += gap * gap;
    }
    const Mask near = sum <= broadcast(limit);
    const F32 counted = select(near, sum, broadcast(INFINITY));
    const float least_here = least_of(counted);
    if (least_here < least) {
      least = least_here;
      const unsigned is_least = bits(counted == broadcast(least));
      nearest = n + count_bits(bits(near) & (is_least - 1) & ~is_least);
    }
    store_chosen(d2 + n, near, sum);
    store_chosen(reinterpret_cast<int32_t*>(numbers) + n, near,
                 lane_numbers() + broadcast(static_cast<int32_t>(first_number) + lane));
    n += count(near);
  }
  if (n > 0) swap_with_last(nearest, n, numbers, d2);
  return n;
}

int near_boxes(const BoxGroup<double>& group, const double* place, double limit, uint32_t first_number,
               uint32_t* numbers, double* d2) {
  int n = 0, nearest = 0;
  double sums[group_boxes], least = INFINITY;
  for (int lane = 0; lane < group_boxes; ++lane) {
    sums[lane] = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double before = group.lo[axis][lane] - place[axis], behind = place[axis] - group.hi[axis][lane];
      const double outside = before > behind ? before : behind, gap = outside > 0 ? outside : 0;
      sums[lane] += gap * gap;
    }
  }
  for (int lane = 0; lane < group_boxes; ++lane) {
    d2[n] = sums[lane];
    numbers[n] = first_number + static_cast<uint32_t>(lane);
    const bool near = sums[lane] <= limit, is_least = near && sums[lane] < least;
    nearest = is_least ? n : nearest;
    least = is_least ? sums[lane] : least;
    n += static_cast<int>(near);
  }
  if (n > 0) swap_with_last(nearest, n, numbers, d2);
  return n;
}

template <class T>
unsigned point_distances(const PointBlock<T>& block, const T* place, T limit) {
  alignas(64) T d2[block_points];
  for (int lane = 0; lane < block_points; ++lane) {
    const T x = place[0] - block.p[0][lane], y = place[1] - block.p[1][lane], z = place[2] - block.p[2][lane];
    d2[lane] = x * x + y * y + z * z;
  }
  return lanes_within(d2, limit);
}

template <class T>
int near_points(const BlockTreeView<T>& tree, const double* place, double radius2, int most, uint32_t* slots) {
  GroupFrame<T> frame;
  Candidates candidates;
  if (!make_frame(place, radius2, frame) || !collect<Position::none>(tree, frame, candidates, most)) return -1;
  memcpy(slots, candidates.slot, static_cast<size_t>(candidates.count) * sizeof *slots);
  return candidates.count;
}

}  // namespace

int near_boxes_f32(const BoxGroup<float>& group, const float* place, float limit, uint32_t first_number,
                   uint32_t* numbers, float* d2) {
  return near_boxes(group, place, limit, first_number, numbers, d2);
}
int near_boxes_f64(const BoxGroup<double>& group, const double* place, double limit, uint32_t first_number,
                   uint32_t* numbers, double* d2) {
  return near_boxes(group, place, limit, first_number, numbers, d2);
}
unsigned point_distances_f32(const PointBlock<float>& block, const float* place, float limit) {
  return point_distances(block, place, limit);
}
unsigned point_distances_f64(const PointBlock<double>& block, const double* place, double limit) {
  return point_distances(block, place, limit);
}
int near_points_f32(const BlockTreeView<float>& tree, const double* place, double radius2, int most, uint32_t* slots) {
  return near_points(tree, place, radius2, most, slots);
}
int near_points_f64(const BlockTreeView<double>& tree, const double* place, double radius2, int most, uint32_t* slots) {
  return near_points(tree, place, radius2, most, slots);
}

}  // namespace nacre::simd::NACRE_ISA
