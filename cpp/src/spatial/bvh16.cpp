#include "spatial/bvh16.hpp"

#include <algorithm>

#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "spatial/hilbert_order.hpp"

namespace nacre {
namespace {

template <class T>
struct Bounds {
  T lo[3], hi[3];
  std::uint32_t first_id;
};

// Folds 16 lanes in halves.
template <class T, class Fold>
T fold_lanes(const T (&lanes)[16], Fold fold) {
  T eight[8], four[4];
  for (int i = 0; i < 8; ++i) eight[i] = fold(lanes[i], lanes[i + 8]);
  for (int i = 0; i < 4; ++i) four[i] = fold(eight[i], eight[i + 4]);
  return fold(fold(four[0], four[2]), fold(four[1], four[3]));
}

// Of NaN and a number, the number, if either comes first or second: unused lanes do not count.
constexpr auto lesser = [](auto a, auto b) { return !(b < a) && a == a ? a : b; };
constexpr auto greater = [](auto a, auto b) { return !(b > a) && a == a ? a : b; };

template <class T>
Bounds<T> box_of(const PointBlock<T>& block) {
  Bounds<T> box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = fold_lanes(block.p[axis], lesser);
    box.hi[axis] = fold_lanes(block.p[axis], greater);
  }
  box.first_id = fold_lanes(block.id, lesser);
  return box;
}

template <class T>
Bounds<T> box_of(const BoxGroup<T>& group) {
  Bounds<T> box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = fold_lanes(group.lo[axis], lesser);
    box.hi[axis] = fold_lanes(group.hi[axis], greater);
  }
  box.first_id = fold_lanes(group.first_id, lesser);
  return box;
}

std::uint32_t curve_key(const float* point, const simd::CurveCube<float>& cube) {
  return simd::curve_key_f32()(point, cube);
}
std::uint32_t curve_key(const double* point, const simd::CurveCube<double>& cube) {
  return simd::curve_key_f64()(point, cube);
}

constexpr std::int64_t groups_for(std::int64_t children) { return (children + group_boxes - 1) / group_boxes; }

// Fills groups with the boxes of the level below.
template <class T, class Child>
void fill_groups(const Child* children, std::int64_t num_children, BoxGroup<T>* groups, int num_threads) {
  constexpr T inf = infinity<T>;
  parallel_for(groups_for(num_children), 64, num_threads, [&](std::int64_t i) {
    BoxGroup<T>& group = groups[i];
    for (int lane = 0; lane < group_boxes; ++lane) {
      const std::int64_t child = i * group_boxes + lane;
      const Bounds<T> box =
          child < num_children ? box_of(children[child]) : Bounds<T>{{inf, inf, inf}, {-inf, -inf, -inf}, no_id};
      for (int axis = 0; axis < 3; ++axis) {
        group.lo[axis][lane] = box.lo[axis];
        group.hi[axis][lane] = box.hi[axis];
      }
      group.first_id[lane] = box.first_id;
    }
  });
}

}  // namespace

template <class T>
BlockTree<T>::BlockTree(const T* points, std::int64_t count, int num_threads) {
  build_blocks(points, count, num_threads);
  if (num_points_ > 0) build_groups(num_threads);
}

template <class T>
void BlockTree<T>::build_blocks(const T* points, std::int64_t count, int num_threads) {
  SpatialOrder<T> order(points, count, num_threads);
  num_points_ = order.size();
  cube_ = order.cube();
  keys_.resize(static_cast<std::size_t>((num_points_ + block_points - 1) / block_points));
  blocks_ = Buffer<PointBlock<T>>(static_cast<std::size_t>((num_points_ + block_points - 1) / block_points));
  view_.blocks = blocks_.data();
  order.for_each_stretch(num_threads, [&](std::int64_t first, const std::uint64_t* entries, std::int64_t size) {
    for (std::int64_t i = 0; i < size; ++i) {
      const std::uint32_t row = SpatialOrder<T>::row(entries[i]);
      const auto slot = static_cast<std::size_t>(first + i);
      PointBlock<T>& block = blocks_[slot / block_points];
      const std::size_t lane = slot % block_points;
      const T* const point = points + 3 * static_cast<std::int64_t>(row);
      if (lane == 0) keys_[slot / block_points] = curve_key(point, cube_);
      for (int axis = 0; axis < 3; ++axis) block.p[axis][lane] = point[axis];
      block.id[lane] = row;
    }
  });
  for (auto slot = static_cast<std::size_t>(num_points_); slot < blocks_.size() * block_points; ++slot) {
    PointBlock<T>& block = blocks_[slot / block_points];
    for (auto& coordinates : block.p) coordinates[slot % block_points] = std::numeric_limits<T>::quiet_NaN();
    block.id[slot % block_points] = no_id;
  }
}

template <class T>
void BlockTree<T>::build_groups(int num_threads) {
  const auto num_blocks = static_cast<std::int64_t>(blocks_.size());
  std::int64_t num_groups = 0;
  for (std::int64_t n = num_blocks; n > 1 || num_groups == 0; num_groups += n) n = groups_for(n);
  groups_ = Buffer<BoxGroup<T>>(static_cast<std::size_t>(num_groups));
  BoxGroup<T>* level = groups_.data();
  fill_groups(blocks_.data(), num_blocks, level, num_threads);
  view_.levels[view_.num_levels++] = level;
  for (std::int64_t n = groups_for(num_blocks); n > 1; n = groups_for(n)) {
    fill_groups(level, n, level + n, num_threads);
    level += n;
    view_.levels[view_.num_levels++] = level;
  }
}

template class BlockTree<float>;
template class BlockTree<double>;

}  // namespace nacre
