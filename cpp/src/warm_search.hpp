// Searching near the last place is cheap.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

#include "block_tree.hpp"

namespace nacre {

// The k nearest of query after query. Earlier answers bound the next one: k points within r of one place are within
// r + |step| of another.
template <class Tree>
class WarmSearch {
 public:
  WarmSearch(const Tree& tree, int k, double max_distance)
      : tree_(tree), max_d2_(squared_bound(max_distance)), found_(static_cast<std::size_t>(k)) {}

  // Returns how many were found.
  int operator()(const Eigen::Vector3d& query) {
    constexpr double rounding = 1.0 + 1e-12, tiny = std::numeric_limits<double>::min();
    const double reach =
        (((x_ - query.x()).square() + (y_ - query.y()).square() + (z_ - query.z()).square()).sqrt() + radius_)
            .minCoeff();
    const double bound = reach * reach * rounding + tiny;
    KNearest nearest(static_cast<int>(found_.size()), bound < max_d2_ ? bound : max_d2_, found_.data());
    tree_.search(query, nearest);
    if (nearest.size() == static_cast<int>(found_.size())) {
      x_[next_] = query.x();
      y_[next_] = query.y();
      z_[next_] = query.z();
      radius_[next_] = std::sqrt(found_.back().d2);
      next_ = (next_ + 1) % static_cast<int>(x_.size());
    }
    return nearest.size();
  }

  const Found& operator[](int rank) const { return found_[static_cast<std::size_t>(rank)]; }

 private:
  using Answers = Eigen::Array<double, 8, 1>;

  const Tree& tree_;
  double max_d2_;
  std::vector<Found> found_;
  Answers x_ = Answers::Zero(), y_ = Answers::Zero(), z_ = Answers::Zero();      // the places of the last answers
  Answers radius_ = Answers::Constant(std::numeric_limits<double>::infinity());  // the distances of their k-th points
  int next_ = 0;
};

}  // namespace nacre
