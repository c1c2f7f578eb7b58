// Points sorted by the cubic cell they lie in, for sums over all points within one cell edge of a place.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "nacre/types.hpp"
#include "pair_kernel.hpp"

namespace nacre {

// The cells that hold points are numbered by z, then y, then x, the points by their cells: the 27 cells around one are
// at most nine ranges of points.
class CellGrid {
 public:
  // Where a cell lies. Those farther than a million edges from the origin share the outermost one: slower there, never
  // wrong.
  using Key = std::uint64_t;

  CellGrid(const Eigen::Vector3d& origin, double edge) : origin_(origin), inverse_edge_(1.0 / edge) {}

  // Holds the given rows of points. Rows in nearly the right order are sorted faster.
  void build(const PointsRef& points, const std::vector<std::int64_t>& rows) {
    std::vector<std::pair<Key, std::int64_t>> keyed;
    keyed.reserve(rows.size());
    for (const std::int64_t row : rows) keyed.emplace_back(key_of(points.row(row)), row);
    std::sort(keyed.begin(), keyed.end());

    rows_.resize(keyed.size());
    for (std::vector<float>* axis : {&x_, &y_, &z_}) axis->assign(keyed.size() + pair_lanes - 1, 0.0F);
    keys_.clear();
    starts_.clear();
    for (std::size_t i = 0; i < keyed.size(); ++i) {
      const auto& [key, row] = keyed[i];
      rows_[i] = row;
      x_[i] = points(row, 0);
      y_[i] = points(row, 1);
      z_[i] = points(row, 2);
      if (keys_.empty() || keys_.back() != key) {
        keys_.push_back(key);
        starts_.push_back(i);
      }
    }
    starts_.push_back(keyed.size());
  }

  std::size_t size() const { return rows_.size(); }
  std::int64_t row(std::size_t i) const { return rows_[i]; }
  const std::vector<std::int64_t>& rows() const { return rows_; }
  Eigen::Vector3f point(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }

  std::size_t num_cells() const { return keys_.size(); }
  Key key(std::size_t cell) const { return keys_[cell]; }
  std::size_t begin(std::size_t cell) const { return starts_[cell]; }
  std::size_t end(std::size_t cell) const { return starts_[cell + 1]; }

  // The points with masses, padded_size() of them in their order.
  PairPoints with_mass(const std::vector<float>& mass) const { return {x_.data(), y_.data(), z_.data(), mass.data()}; }
  std::size_t padded_size() const { return x_.size(); }

 private:
  friend class CellWalk;

  static constexpr int bits = 21;
  static constexpr Key one_y = Key{1} << bits, one_z = Key{1} << (2 * bits);

  template <class Row>
  Key key_of(const Row& point) const {
    constexpr double half = 1 << (bits - 1);
    Key key = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const double cell = std::floor((static_cast<double>(point[axis]) - origin_[axis]) * inverse_edge_);
      key = (key << bits) | static_cast<Key>(std::clamp(cell, 1.0 - half, half - 2.0) + half);
    }
    return key;
  }

  Eigen::Vector3d origin_;
  double inverse_edge_;
  std::vector<float> x_, y_, z_;
  std::vector<std::int64_t> rows_;
  std::vector<std::size_t> starts_;
  std::vector<Key> keys_;
};

// Finds what is around a cell; faster where the keys ascend from call to call.
class CellWalk {
 public:
  explicit CellWalk(const CellGrid& grid) : grid_(grid) {}

  // visit(first, last) for each range [first, last) of cells around one, which may be of another grid of the same
  // origin and edge.
  template <class Visit>
  void for_each_range(CellGrid::Key key, Visit&& visit) {
    const std::vector<CellGrid::Key>& keys = grid_.keys_;
    const bool onward = last_key_ <= key;
    last_key_ = key;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const CellGrid::Key row =
          key - CellGrid::one_z - CellGrid::one_y + (i / 3) * CellGrid::one_z + (i % 3) * CellGrid::one_y;
      std::size_t& first = first_[i];
      if (!onward) first = static_cast<std::size_t>(std::lower_bound(keys.begin(), keys.end(), row - 1) - keys.begin());
      while (first < keys.size() && keys[first] < row - 1) ++first;
      std::size_t last = first;
      while (last < keys.size() && keys[last] <= row + 1) ++last;
      if (last > first) visit(first, last);
    }
  }

  // The points around a cell.
  PairRuns around(CellGrid::Key key) {
    PairRuns runs;
    for_each_range(key, [&](std::size_t first, std::size_t last) {
      runs.ranges[runs.count++] = {grid_.begin(first), grid_.begin(last)};
    });
    return runs;
  }

 private:
  const CellGrid& grid_;
  CellGrid::Key last_key_ = std::numeric_limits<CellGrid::Key>::max();
  std::array<std::size_t, 9> first_{};
};

}  // namespace nacre
