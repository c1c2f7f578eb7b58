// A bounding volume hierarchy over triangles: built top-down by the surface area heuristic (SAH) over binned centroids
// (Wald 2007), walked nearest box first.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/numbers.hpp"

namespace nacre {

struct Box {
  Eigen::Vector3f lower = Eigen::Vector3f::Constant(infinity<float>);
  Eigen::Vector3f upper = Eigen::Vector3f::Constant(-infinity<float>);

  void extend(const Box& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  void extend(const Eigen::Vector3f& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  Eigen::Vector3f center() const { return 0.5F * lower + 0.5F * upper; }
  double half_area() const {
    const Eigen::Vector3d side = upper.cast<double>() - lower.cast<double>();
    return side.x() * side.y() + side.y() * side.z() + side.z() * side.x();
  }
};

struct BvhNode {
  std::array<Eigen::Vector3f, 2> corners;  // lower, upper
  std::int32_t first = 0;                  // leaf: the first item; inner node: the first of two adjacent children
  std::int32_t count = 0;                  // items of a leaf; 0: an inner node
};

class Bvh {
 public:
  // The items' boxes; `order` lists the items leaf after leaf.
  explicit Bvh(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::int32_t>(i);
    nodes_.reserve(boxes_.size());
    nodes_.emplace_back();
    build(0, 0, static_cast<std::int32_t>(order_.size()), 0);
    boxes_ = {};
  }

  const std::vector<BvhNode>& nodes() const { return nodes_; }
  const std::vector<std::int32_t>& order() const { return order_; }

  // Calls leaf(first, count) for leaves nearest first. entry(node) is a bound of what a node can give, infinity for
  // nothing; nodes whose bound exceeds limit() are skipped.
  template <class Entry, class Limit, class Leaf>
  void walk(Entry&& entry, Limit&& limit, Leaf&& leaf) const {
    std::array<std::pair<double, std::int32_t>, max_depth + 1> stack;
    std::size_t size = 0;
    const double root = entry(nodes_[0]);
    if (root < infinity<double>) stack[size++] = {root, 0};
    while (size > 0) {
      const auto [bound, index] = stack[--size];
      if (bound > limit()) continue;
      const BvhNode& node = nodes_[static_cast<std::size_t>(index)];
      if (node.count > 0) {
        leaf(node.first, node.count);
        continue;
      }
      std::pair<double, std::int32_t> near{entry(nodes_[static_cast<std::size_t>(node.first)]), node.first};
      std::pair<double, std::int32_t> far{entry(nodes_[static_cast<std::size_t>(node.first) + 1]), node.first + 1};
      if (far.first < near.first) std::swap(near, far);
      if (far.first < infinity<double>) stack[size++] = far;
      if (near.first < infinity<double>) stack[size++] = near;
    }
  }

 private:
  static constexpr int num_bins = 16;
  static constexpr int max_leaf = 8;
  static constexpr int sah_depth = 32;  // below it nodes are halved, which ends after 31 more levels
  static constexpr std::size_t max_depth = sah_depth + 32;

  struct Bin {
    Box box;
    std::int32_t count = 0;
  };
  struct Split {
    int axis = -1;  // none
    int bin = 0;    // the items of the bins 0 to this go left
    double cost = infinity<double>;
  };

  static int bin_of(const Box& box, const Box& centers, int axis) {
    const double lower = centers.lower[axis], extent = static_cast<double>(centers.upper[axis]) - lower;
    return std::min(num_bins - 1, static_cast<int>(num_bins * ((box.center()[axis] - lower) / extent)));
  }

  const Box& box(std::int32_t position) const {
    return boxes_[static_cast<std::size_t>(order_[static_cast<std::size_t>(position)])];
  }

  Split best_split(std::int32_t begin, std::int32_t end, const Box& centers) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(centers.upper[axis] > centers.lower[axis])) continue;
      std::array<Bin, num_bins> bins;
      for (std::int32_t i = begin; i < end; ++i) {
        Bin& bin = bins[static_cast<std::size_t>(bin_of(box(i), centers, axis))];
        bin.box.extend(box(i));
        ++bin.count;
      }
      std::array<double, num_bins> left_cost{};
      Bin sum;
      for (std::size_t b = 0; b + 1 < num_bins; ++b) {
        sum.box.extend(bins[b].box);
        sum.count += bins[b].count;
        left_cost[b] = sum.count > 0 ? sum.count * sum.box.half_area() : infinity<double>;
      }
      sum = {};
      for (std::size_t b = num_bins - 1; b > 0; --b) {
        sum.box.extend(bins[b].box);
        sum.count += bins[b].count;
        if (sum.count == 0) continue;
        const double cost = left_cost[b - 1] + sum.count * sum.box.half_area();
        if (cost < best.cost) best = {axis, static_cast<int>(b) - 1, cost};
      }
    }
    return best;
  }

  void build(std::int32_t index, std::int32_t begin, std::int32_t end, int depth) {
    Box bounds, centers;
    for (std::int32_t i = begin; i < end; ++i) {
      bounds.extend(box(i));
      centers.extend(box(i).center());
    }
    const auto at = static_cast<std::size_t>(index);
    nodes_[at].corners = {bounds.lower, bounds.upper};

    const std::int32_t count = end - begin;
    const Split split = count > 1 && depth < sah_depth ? best_split(begin, end, centers) : Split();
    const double leaf_cost = (count - 1) * bounds.half_area();  // a step down the tree costs as much as one triangle
    if (count == 1 || (count <= max_leaf && split.cost >= leaf_cost)) {
      nodes_[at].first = begin;
      nodes_[at].count = count;
      return;
    }
    std::int32_t middle = begin + count / 2;
    if (split.axis >= 0) {
      const auto goes_left = [&](std::int32_t item) {
        return bin_of(boxes_[static_cast<std::size_t>(item)], centers, split.axis) <= split.bin;
      };
      middle = static_cast<std::int32_t>(std::partition(order_.begin() + begin, order_.begin() + end, goes_left) -
                                         order_.begin());
    }
    const auto children = static_cast<std::int32_t>(nodes_.size());
    nodes_[at].first = children;
    nodes_.resize(nodes_.size() + 2);
    build(children, begin, middle, depth + 1);
    build(children + 1, middle, end, depth + 1);
  }

  std::vector<Box> boxes_;
  std::vector<std::int32_t> order_;
  std::vector<BvhNode> nodes_;
};

}  // namespace nacre
