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

// Along one axis, equal coordinates by id: no two points are equal.
template <class T>
struct Before {
  int axis;
  bool operator()(const IndexedPoint<T>& a, const IndexedPoint<T>& b) const {
    return (a.p[axis] < b.p[axis]) | ((a.p[axis] == b.p[axis]) & (a.id < b.id));
  }
};

// Every n-th point of a range: enough to know its widest axis and to guess its median.
template <class T>
struct Sample {
  IndexedPoint<T> points[64];
  int size;

  Sample(const IndexedPoint<T>* begin, const IndexedPoint<T>* end) {
    const std::int64_t count = end - begin;
    size = static_cast<int>(std::min<std::int64_t>({count, 64, std::max<std::int64_t>(count / 16, 8)}));
    for (int i = 0; i < size; ++i) points[i] = begin[i * count / size];
  }

  int widest_axis() const {
    int widest = 0;
    T largest = -1;
    for (int axis = 0; axis < 3; ++axis) {
      T lo = points[0].p[axis], hi = lo;
      for (int i = 1; i < size; ++i) {
        lo = std::min(lo, points[i].p[axis]);
        hi = std::max(hi, points[i].p[axis]);
      }
      if (hi - lo > largest) {
        largest = hi - lo;
        widest = axis;
      }
    }
    return widest;
  }
};

// Moves the points before the pivot to the front, without branches, and returns the first of the others.
template <class T>
IndexedPoint<T>* partition_points(IndexedPoint<T>* begin, IndexedPoint<T>* end, const IndexedPoint<T> pivot,
                                  const Before<T> before) {
  IndexedPoint<T>* store = begin;
  for (IndexedPoint<T>* item = begin; item != end; ++item) {
    const IndexedPoint<T> point = *item;
    *item = *store;
    *store = point;
    store += before(point, pivot);
  }
  return store;
}

// std::nth_element in half the time: pivots are guessed from samples, a little beyond the place sought, so that the
// part which holds it is small (Floyd and Rivest 1975).
template <class T>
void select_points(IndexedPoint<T>* begin, IndexedPoint<T>* middle, IndexedPoint<T>* end, const Before<T> before) {
  for (int pass = 0; pass < 16 && end - begin > 64; ++pass) {
    Sample<T> sample(begin, end);
    const double place = static_cast<double>(middle - begin) / static_cast<double>(end - begin);
    const int margin = sample.size / 16;
    const int rank = static_cast<int>(place * sample.size) + (place < 0.5 ? margin : -margin);
    IndexedPoint<T>* guess = sample.points + std::clamp(rank, 0, sample.size - 1);
    std::nth_element(sample.points, guess, sample.points + sample.size, before);
    IndexedPoint<T>* cut = partition_points(begin, end, *guess, before);
    (middle < cut ? end : begin) = cut;
  }
  std::nth_element(begin, middle, end, before);
}

// Cuts a range of more than one leaf in two and returns the first point of the second part.
template <class T>
IndexedPoint<T>* kd_split(IndexedPoint<T>* begin, IndexedPoint<T>* end) {
  std::int64_t subtree = leaf_points;
  while (subtree * 8 < end - begin) subtree *= 8;
  const std::int64_t num_subtrees = (end - begin + subtree - 1) / subtree;
  IndexedPoint<T>* middle = begin + num_subtrees / 2 * subtree;
  select_points(begin, middle, end, Before<T>{Sample<T>(begin, end).widest_axis()});
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

// Sorts points into k-d order: level by level until there is work for every thread, then each range to its end.
template <class T>
void kd_order(std::vector<IndexedPoint<T>>& points, int num_threads) {
  constexpr std::int64_t small = 4096;
  constexpr int max_ranges = 32;
  std::vector<IndexedPoint<T>*> bounds = {points.data(), points.data() + points.size()};
  const auto length = [&bounds](std::size_t i) { return bounds[i + 1] - bounds[i]; };
  for (std::size_t ranges = 1; ranges < max_ranges && length(0) > small; ranges = bounds.size() - 1) {
    std::vector<IndexedPoint<T>*> cuts(2 * ranges + 1, bounds.back());
    parallel_for(static_cast<std::int64_t>(ranges), 1, num_threads, [&](std::int64_t i) {
      const auto r = static_cast<std::size_t>(i);
      cuts[2 * r] = bounds[r];
      cuts[2 * r + 1] = length(r) > leaf_points ? kd_split(bounds[r], bounds[r + 1]) : bounds[r];
    });
    bounds.swap(cuts);
  }
  parallel_for(static_cast<std::int64_t>(bounds.size()) - 1, 1, num_threads, [&](std::int64_t i) {
    kd_order_serial(bounds[static_cast<std::size_t>(i)], bounds[static_cast<std::size_t>(i) + 1]);
  });
}

}  // namespace nacre
