// Points sorted by the cubic cell they lie in, for sums over all points within one cell edge of a place. The points of
// neighbouring cells along x follow each other, so that the 27 cells around a place are at most nine runs of memory.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "nacre/types.hpp"
#include "pair_kernel.hpp"

namespace nacre {

class CellGrid {
 public:
  // A cell, ordered by z, then y, then x. Cells farther than a million edges from the origin share the outermost one:
  // slower there, never wrong.
  using Key = std::uint64_t;

  CellGrid(const Eigen::Vector3d& origin, double edge) : origin_(origin), inverse_edge_(1.0 / edge) {}

  // Holds the given rows of points. Rows in nearly the right order are sorted faster.
  void build(const Points& points, const std::vector<std::int64_t>& rows) {
    std::vector<std::pair<Key, std::int64_t>> keyed;
    keyed.reserve(rows.size());
    for (const std::int64_t row : rows) keyed.emplace_back(key_of(points.row(row)), row);
    std::sort(keyed.begin(), keyed.end());

    const std::size_t padded = keyed.size() + pair_lanes - 1;
    x_.assign(padded, 0.0F);
    y_.assign(padded, 0.0F);
    z_.assign(padded, 0.0F);
    rows_.resize(keyed.size());
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
        starts_.push_back(static_cast<std::int64_t>(i));
      }
    }
    starts_.push_back(static_cast<std::int64_t>(keyed.size()));
  }

  std::int64_t size() const { return static_cast<std::int64_t>(rows_.size()); }
  const std::vector<std::int64_t>& rows() const { return rows_; }
  Eigen::Vector3f point(std::int64_t i) const {
    const auto k = static_cast<std::size_t>(i);
    return {x_[k], y_[k], z_[k]};
  }
  PairPoints with_mass(const std::vector<float>& mass) const { return {x_.data(), y_.data(), z_.data(), mass.data()}; }
  std::size_t padded_size() const { return x_.size(); }

  // Cells that hold points are numbered in the order of their keys.
  std::int64_t num_cells() const { return static_cast<std::int64_t>(keys_.size()); }
  Key key(std::int64_t cell) const { return keys_[static_cast<std::size_t>(cell)]; }
  std::int64_t begin(std::int64_t cell) const { return starts_[static_cast<std::size_t>(cell)]; }

  // visit(first, last) for each sequence [first, last) of cells around the given one, in order.
  template <class Visit>
  void for_each_run(Key center, Visit&& visit) const {
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        const Key row = center + static_cast<Key>(dz) * one_z + static_cast<Key>(dy) * one_y;
        const auto first = std::lower_bound(keys_.begin(), keys_.end(), row - 1);
        auto last = first;
        while (last != keys_.end() && *last <= row + 1) ++last;
        if (first != last) visit(first - keys_.begin(), last - keys_.begin());
      }
    }
  }

 private:
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
  std::vector<std::int64_t> rows_, starts_;
  std::vector<Key> keys_;
};

}  // namespace nacre
