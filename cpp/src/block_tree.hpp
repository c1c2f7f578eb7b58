// The k-d tree: points in k-d order in blocks of 16 under a hierarchy of bounding boxes, 8 children each.
//
// Searches filter in the precision of the coordinates (T) and decide in double: a lane passes where its distance in T
// is not above a slightly enlarged bound, then its exact distance is compared.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "kd_blocks.hpp"
#include "kd_order.hpp"
#include "nacre/types.hpp"

namespace nacre {

// A point that a search found.
struct Found {
  double d2;           // squared distance [m^2]
  std::uint32_t id;    // row of the caller's array
  std::uint32_t slot;  // place in the tree: lane + 16 * block
};

inline bool operator<(const Found& a, const Found& b) { return a.d2 < b.d2 || (a.d2 == b.d2 && a.id < b.id); }

constexpr std::uint32_t no_id = std::numeric_limits<std::uint32_t>::max();

// The largest square whose root is not above the distance: a point is within a distance where its distance, as
// reported, is not above it.
inline double squared_bound(double distance) {
  double square = distance * distance;
  while (std::isfinite(square)) {
    const double next = std::nextafter(square, std::numeric_limits<double>::infinity());
    if (std::sqrt(next) > distance) break;
    square = next;
  }
  return square;
}

// The k nearest within a distance, sorted, in the caller's memory.
class KNearest {
 public:
  KNearest(int k, double bound_d2, Found* found)
      : bound_{bound_d2, no_id, no_id}, begin_(found), end_(found), full_(found + k) {}
  int size() const { return static_cast<int>(end_ - begin_); }
  const Found& bound() const { return bound_; }
  void add(const Found& point) {
    if (!(point < bound_)) return;
    if (end_ != full_) ++end_;
    Found* place = end_ - 1;
    for (; place != begin_ && point < place[-1]; --place) *place = place[-1];
    *place = point;
    if (end_ == full_) bound_ = end_[-1];
  }

 private:
  Found bound_;
  Found *begin_, *end_, *full_;
};

// Everything within a distance, unsorted.
class WithinRadius {
 public:
  WithinRadius(double bound_d2, std::vector<Found>& found) : bound_{bound_d2, no_id, no_id}, found_(found) {}
  const Found& bound() const { return bound_; }
  void add(const Found& point) {
    if (point < bound_) found_.push_back(point);
  }

 private:
  Found bound_;
  std::vector<Found>& found_;
};

static_assert(leaf_points == block_points && group_boxes == 8, "every block and group is a subtree of the k-d order");

template <class T>
class BlockTree {
 public:
  BlockTree(const Eigen::Ref<const PointMatrix<T>>& points, int num_threads);

  // The finite points, numbered by their places in the tree.
  std::int64_t num_points() const { return num_points_; }
  std::uint32_t id(std::uint32_t slot) const { return blocks_[slot / block_points].id[slot % block_points]; }
  Eigen::Vector3d position(std::uint32_t slot) const {
    const PointBlock<T>& block = blocks_[slot / block_points];
    const int lane = static_cast<int>(slot % block_points);
    return {block.p[0][lane], block.p[1][lane], block.p[2][lane]};
  }

  // Shows results.add() every point that may be within results.bound(), mostly near ones first.
  template <class Results>
  void search(const Eigen::Vector3d& query, Results& results) const;

 private:
  struct Box {
    T lo[3], hi[3];
    std::uint32_t first_id;
    void include(const Box& other);
  };

  std::vector<Box> build_blocks(const std::vector<IndexedPoint<T>>& points, int num_threads);
  std::vector<Box> build_groups(const std::vector<Box>& children, std::size_t first_child, int num_threads);
  Found nearest_possible(std::uint32_t box, const Eigen::Vector3d& query) const;

  std::int64_t num_points_;
  std::vector<PointBlock<T>> blocks_;
  // Level after level, the groups over the blocks first, the root last. Box j of group g has the number 8 g + j, which
  // for the blocks' boxes is the number of the block.
  std::vector<BoxGroup<T>> groups_;
};

template <class T>
BlockTree<T>::BlockTree(const Eigen::Ref<const PointMatrix<T>>& points, int num_threads) {
  std::vector<IndexedPoint<T>> ordered = finite_points<T>(points);
  num_points_ = static_cast<std::int64_t>(ordered.size());
  kd_order(ordered, num_threads);
  std::vector<Box> boxes = build_blocks(ordered, num_threads);
  for (std::size_t first_child = 0; boxes.size() > (groups_.empty() ? 0u : 1u);) {
    const std::size_t first_group = groups_.size();
    boxes = build_groups(boxes, first_child, num_threads);
    first_child = first_group;
  }
}

template <class T>
void BlockTree<T>::Box::include(const Box& other) {
  for (int axis = 0; axis < 3; ++axis) {
    lo[axis] = std::min(lo[axis], other.lo[axis]);
    hi[axis] = std::max(hi[axis], other.hi[axis]);
  }
  first_id = std::min(first_id, other.first_id);
}

// Packs the points into blocks and returns the boxes of the blocks.
template <class T>
std::vector<typename BlockTree<T>::Box> BlockTree<T>::build_blocks(const std::vector<IndexedPoint<T>>& points,
                                                                   int num_threads) {
  constexpr T nan = std::numeric_limits<T>::quiet_NaN();
  blocks_.resize((points.size() + block_points - 1) / block_points);
  std::vector<Box> boxes(blocks_.size());
  parallel_for(static_cast<std::int64_t>(blocks_.size()), 256, num_threads, [&](std::int64_t i) {
    PointBlock<T>& block = blocks_[static_cast<std::size_t>(i)];
    const std::size_t first = static_cast<std::size_t>(i) * block_points;
    const std::size_t count = std::min<std::size_t>(points.size() - first, block_points);
    for (std::size_t lane = 0; lane < block_points; ++lane) {
      const IndexedPoint<T> point = lane < count ? points[first + lane] : IndexedPoint<T>{{nan, nan, nan}, no_id};
      for (int axis = 0; axis < 3; ++axis) block.p[axis][static_cast<int>(lane)] = point.p[axis];
      block.id[lane] = point.id;
      if (lane >= count) continue;
      const Box box = {{point.p[0], point.p[1], point.p[2]}, {point.p[0], point.p[1], point.p[2]}, point.id};
      if (lane == 0) boxes[static_cast<std::size_t>(i)] = box;
      boxes[static_cast<std::size_t>(i)].include(box);
    }
  });
  return boxes;
}

// Packs the boxes of one level into groups and returns the boxes of the groups.
template <class T>
std::vector<typename BlockTree<T>::Box> BlockTree<T>::build_groups(const std::vector<Box>& children,
                                                                   std::size_t first_child, int num_threads) {
  const std::size_t first_group = groups_.size();
  std::vector<Box> boxes((children.size() + group_boxes - 1) / group_boxes);
  groups_.resize(first_group + boxes.size());
  parallel_for(static_cast<std::int64_t>(boxes.size()), 256, num_threads, [&](std::int64_t i) {
    BoxGroup<T>& group = groups_[first_group + static_cast<std::size_t>(i)];
    const std::size_t first = static_cast<std::size_t>(i) * group_boxes;
    const std::size_t count = std::min<std::size_t>(children.size() - first, group_boxes);
    Box box = children[first];
    for (std::size_t lane = 0; lane < group_boxes; ++lane) {
      const Box& child = children[first + std::min(lane, count - 1)];
      for (int axis = 0; axis < 3; ++axis) {
        group.lo[axis][static_cast<int>(lane)] = child.lo[axis];
        group.hi[axis][static_cast<int>(lane)] = child.hi[axis];
      }
      group.first_id[lane] = child.first_id;
      box.include(child);
    }
    group.first_child = static_cast<std::uint32_t>(first_child + first);
    group.used = (1u << count) - 1;
    boxes[static_cast<std::size_t>(i)] = box;
  });
  return boxes;
}

// No point of the box comes before this one: rounding is monotonic, so the box's distance is not above any of theirs.
template <class T>
Found BlockTree<T>::nearest_possible(std::uint32_t box, const Eigen::Vector3d& query) const {
  const BoxGroup<T>& group = groups_[box / group_boxes];
  const auto lane = static_cast<int>(box % group_boxes);
  double outside[3];
  for (int axis = 0; axis < 3; ++axis) {
    outside[axis] = std::max({0.0, group.lo[axis][lane] - query[axis], query[axis] - group.hi[axis][lane]});
  }
  return {outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2], group.first_id[lane], no_id};
}

template <class T>
template <class Results>
void BlockTree<T>::search(const Eigen::Vector3d& query, Results& results) const {
  if (groups_.empty() || !query.allFinite()) return;
  const T q[3] = {static_cast<T>(query.x()), static_cast<T>(query.y()), static_cast<T>(query.z())};

  // A point at distance d of the query is at most d + e from q, e being the query's rounding, and for any s > 0
  // (d + e)^2 <= (1 + s) d^2 + (1 + 1/s) e^2; with s = 1/32 the factors below also cover the rounding of distances.
  // (e is not measured: GCC 12 takes vectors of double(float(x)) for x.)
  constexpr double half_ulp = std::numeric_limits<T>::epsilon() / 2.0;
  const double slack = 40.0 * half_ulp * half_ulp * query.squaredNorm() + std::numeric_limits<T>::min();
  T limit, tie;  // boxes beyond `limit` are out; those beyond `tie` may lose to the smaller ids of equal distances
  const auto tighten = [&] {
    limit = static_cast<T>(1.04 * results.bound().d2 + slack);
    tie = static_cast<T>(0.96 * results.bound().d2 - slack);
  };
  tighten();

  // The boxes still to visit, nearest on top; opening one adds up to 7 more.
  constexpr int max_levels = 10;  // 16 * 8^10 > 2^32
  T distance[max_levels * (group_boxes - 1) + 1];
  std::uint32_t boxes[max_levels * (group_boxes - 1) + 1];
  int size = 0;
  const auto open = [&](std::size_t index) {
    const BoxGroup<T>& group = groups_[index];
    const typename BoxGroup<T>::Lanes d2 = group.squared_distances(q);
    const int bottom = size;
    for (unsigned mask = lanes_within(d2, limit) & group.used; mask != 0; mask &= mask - 1) {
      const int lane = lowest_lane(mask);
      int place = size++;
      for (; place > bottom && distance[place - 1] <= d2[lane]; --place) {
        distance[place] = distance[place - 1];
        boxes[place] = boxes[place - 1];
      }
      distance[place] = d2[lane];
      boxes[place] = static_cast<std::uint32_t>(index * group_boxes) + static_cast<std::uint32_t>(lane);
    }
  };

  open(groups_.size() - 1);
  while (size > 0) {
    --size;
    const std::uint32_t box = boxes[size];
    if (distance[size] > limit) continue;
    if (distance[size] >= tie && !(nearest_possible(box, query) < results.bound())) continue;
    if (box >= blocks_.size()) {
      open(groups_[box / group_boxes].first_child + box % group_boxes);
      continue;
    }
    const PointBlock<T>& block = blocks_[box];
    const typename PointBlock<T>::Lanes d2 = block.squared_distances(q);
    for (unsigned mask = lanes_within(d2, limit); mask != 0; mask &= mask - 1) {
      const int lane = lowest_lane(mask);
      const double x = block.p[0][lane] - query.x(), y = block.p[1][lane] - query.y(), z = block.p[2][lane] - query.z();
      results.add({x * x + y * y + z * z, block.id[lane], box * block_points + static_cast<std::uint32_t>(lane)});
    }
    tighten();
  }
}

}  // namespace nacre
