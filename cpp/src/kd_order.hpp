// Puts points into the order of a balanced k-d tree, so that neighbours in space become neighbours in memory. Medians
// make this hold for any distribution: clusters, outliers, identical points.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "parallel.hpp"

namespace nacre {

template <class T>
using PointMatrix = Eigen::Matrix<T, Eigen::Dynamic, 3, Eigen::RowMajor>;

// A point and where it came from.
template <class T>
struct IndexedPoint {
  T p[3];
  std::uint32_t id;
};

// The points of a leaf; ranges are cut at leaf_points * 8^n points, so that every aligned run of 8, 64, ... leaves is a
// subtree.
constexpr std::int64_t leaf_points = 16;

// The rows whose three coordinates are finite.
template <class T>
std::vector<IndexedPoint<T>> finite_points(const Eigen::Ref<const PointMatrix<T>>& points) {
  std::vector<IndexedPoint<T>> finite;
  finite.reserve(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const IndexedPoint<T> point = {{points(i, 0), points(i, 1), points(i, 2)}, static_cast<std::uint32_t>(i)};
    if (std::isfinite(point.p[0]) && std::isfinite(point.p[1]) && std::isfinite(point.p[2])) finite.push_back(point);
  }
  return finite;
}

template <class T>
int widest_axis(const IndexedPoint<T>* begin, const IndexedPoint<T>* end) {
  T lo[3] = {begin->p[0], begin->p[1], begin->p[2]};
  T hi[3] = {begin->p[0], begin->p[1], begin->p[2]};
  for (const IndexedPoint<T>* item = begin; item != end; ++item) {
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], item->p[axis]);
      hi[axis] = std::max(hi[axis], item->p[axis]);
    }
  }
  int widest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (hi[axis] - lo[axis] > hi[widest] - lo[widest]) widest = axis;
  }
  return widest;
}

// Cuts a range of more than one leaf in two and returns the first point of the second part.
template <class T>
IndexedPoint<T>* kd_split(IndexedPoint<T>* begin, IndexedPoint<T>* end) {
  std::int64_t subtree = leaf_points;
  while (subtree * 8 < end - begin) subtree *= 8;
  const std::int64_t num_subtrees = (end - begin + subtree - 1) / subtree;
  IndexedPoint<T>* middle = begin + num_subtrees / 2 * subtree;
  const int axis = widest_axis(begin, end);
  std::nth_element(begin, middle, end, [axis](const IndexedPoint<T>& a, const IndexedPoint<T>& b) {
    return a.p[axis] < b.p[axis] || (a.p[axis] == b.p[axis] && a.id < b.id);
  });
  return middle;
}

template <class T>
void kd_order_serial(IndexedPoint<T>* begin, IndexedPoint<T>* end) {
  while (end - begin > leaf_points) {
    IndexedPoint<T>* middle = kd_split(begin, end);
    kd_order_serial(begin, middle);
    begin = middle;
  }
}

template <class T>
void kd_order(std::vector<IndexedPoint<T>>& points, int num_threads) {
  // Level by level until there is work for every thread, then each range to its end.
  constexpr std::int64_t small = 4096;
  std::vector<IndexedPoint<T>*> bounds = {points.data(), points.data() + points.size()};
  for (int level = 0; level < 8; ++level) {
    std::vector<IndexedPoint<T>*> cuts(2 * bounds.size() - 1);
    for (std::size_t i = 0; i < bounds.size(); ++i) cuts[2 * i] = bounds[i];
    parallel_for(static_cast<std::int64_t>(bounds.size()) - 1, 1, num_threads, [&](std::int64_t i) {
      const auto r = static_cast<std::size_t>(i);
      cuts[2 * r + 1] = bounds[r + 1] - bounds[r] > small ? kd_split(bounds[r], bounds[r + 1]) : bounds[r];
    });
    bounds.swap(cuts);
  }
  parallel_for(static_cast<std::int64_t>(bounds.size()) - 1, 1, num_threads, [&](std::int64_t i) {
    kd_order_serial(bounds[static_cast<std::size_t>(i)], bounds[static_cast<std::size_t>(i) + 1]);
  });
}

}  // namespace nacre
