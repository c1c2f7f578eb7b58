// The k-d tree: points in k-d order in blocks of 16 under a hierarchy of bounding boxes, 8 children each. There are no
// pointers: child j of group g is the group (or block) 8 g + j one level below.
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

template <class T>
class BlockTree {
 public:
  BlockTree(const Eigen::Ref<const PointMatrix<T>>& points, int num_threads);

  // Shows results.add() every point that may be within results.bound(), mostly near ones first.
  template <class Results>
  void search(const Eigen::Vector3d& query, Results& results) const;

 private:
  struct Box {
    T lo[3], hi[3];
    std::uint32_t first_id;
  };
  // A box still to visit: child `index` of level `level`; level -1 are the blocks.
  struct Entry {
    T d2;
    int level;
    std::uint32_t index;
  };

  std::vector<Box> build_blocks(const std::vector<IndexedPoint<T>>& points, int num_threads);
  std::vector<Box> build_level(const std::vector<Box>& children, int num_threads);
  Found nearest_possible(const Entry& entry, const Eigen::Vector3d& query) const;

  std::vector<PointBlock<T>> blocks_;
  std::vector<std::vector<BoxGroup<T>>> levels_;  // the boxes of the blocks first, the root last
};

template <class T>
BlockTree<T>::BlockTree(const Eigen::Ref<const PointMatrix<T>>& points, int num_threads) {
  std::vector<IndexedPoint<T>> ordered = finite_points<T>(points);
  kd_order(ordered, num_threads);
  std::vector<Box> boxes = build_blocks(ordered, num_threads);
  while (boxes.size() > (levels_.empty() ? 0u : 1u)) boxes = build_level(boxes, num_threads);
}

template <class T>
std::vector<typename BlockTree<T>::Box> BlockTree<T>::build_blocks(const std::vector<IndexedPoint<T>>& points,
                                                                   int num_threads) {
  blocks_.resize((points.size() + block_points - 1) / block_points);
  std::vector<Box> boxes(blocks_.size());
  parallel_for(static_cast<std::int64_t>(blocks_.size()), 256, num_threads, [&](std::int64_t b) {
    constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    const auto first = static_cast<std::size_t>(b) * block_points;
    PointBlock<T>& block = blocks_[static_cast<std::size_t>(b)];
    Box& box = boxes[static_cast<std::size_t>(b)];
    for (int axis = 0; axis < 3; ++axis) box.lo[axis] = box.hi[axis] = points[first].p[axis];
    box.first_id = points[first].id;
    for (int lane = 0; lane < block_points; ++lane) {
      const std::size_t slot = first + static_cast<std::size_t>(lane);
      const bool used = slot < points.size();
      for (int axis = 0; axis < 3; ++axis) {
        block.p[axis][lane] = used ? points[slot].p[axis] : nan;
        if (!used) continue;
        box.lo[axis] = std::min(box.lo[axis], points[slot].p[axis]);
        box.hi[axis] = std::max(box.hi[axis], points[slot].p[axis]);
      }
      block.id[lane] = used ? points[slot].id : no_id;
      box.first_id = std::min(box.first_id, block.id[lane]);
    }
  });
  return boxes;
}

// Packs the boxes of one level into groups and returns the boxes of the groups.
template <class T>
std::vector<typename BlockTree<T>::Box> BlockTree<T>::build_level(const std::vector<Box>& children, int num_threads) {
  std::vector<BoxGroup<T>> groups((children.size() + group_boxes - 1) / group_boxes);
  std::vector<Box> boxes(groups.size());
  parallel_for(static_cast<std::int64_t>(groups.size()), 256, num_threads, [&](std::int64_t g) {
    const auto first = static_cast<std::size_t>(g) * group_boxes;
    BoxGroup<T>& group = groups[static_cast<std::size_t>(g)];
    Box& box = boxes[static_cast<std::size_t>(g)];
    box = children[first];
    group.used = 0;
    for (int lane = 0; lane < group_boxes; ++lane) {
      const Box& child = children[std::min(first + static_cast<std::size_t>(lane), children.size() - 1)];
      if (first + static_cast<std::size_t>(lane) < children.size()) group.used |= 1u << lane;
      for (int axis = 0; axis < 3; ++axis) {
        group.lo[axis][lane] = child.lo[axis];
        group.hi[axis][lane] = child.hi[axis];
        box.lo[axis] = std::min(box.lo[axis], child.lo[axis]);
        box.hi[axis] = std::max(box.hi[axis], child.hi[axis]);
      }
      group.first_id[lane] = child.first_id;
      box.first_id = std::min(box.first_id, child.first_id);
    }
  });
  levels_.push_back(std::move(groups));
  return boxes;
}

// No point of the box comes before this one: rounding is monotonic, so the box's distance is not above any of theirs.
template <class T>
Found BlockTree<T>::nearest_possible(const Entry& entry, const Eigen::Vector3d& query) const {
  const BoxGroup<T>& group = levels_[static_cast<std::size_t>(entry.level + 1)][entry.index / group_boxes];
  const auto lane = static_cast<int>(entry.index % group_boxes);
  double outside[3];
  for (int axis = 0; axis < 3; ++axis) {
    outside[axis] = std::max({0.0, group.lo[axis][lane] - query[axis], query[axis] - group.hi[axis][lane]});
  }
  return {outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2], group.first_id[lane], no_id};
}

template <class T>
template <class Results>
void BlockTree<T>::search(const Eigen::Vector3d& query, Results& results) const {
  if (levels_.empty() || !query.allFinite()) return;
  const T q[3] = {static_cast<T>(query.x()), static_cast<T>(query.y()), static_cast<T>(query.z())};

  // A point at distance d of the query is at most d + e from q, e = |query - q|, and for any s > 0
  // (d + e)^2 <= (1 + s) d^2 + (1 + 1/s) e^2. s = 1/256 covers the rounding of distances in T as well.
  constexpr double s = 1.0 / 256.0;
  const double slack = (1.0 + 1.0 / s) * (query - Eigen::Vector3d(q[0], q[1], q[2])).squaredNorm() +
                       static_cast<double>(std::numeric_limits<T>::min());
  T limit, tie;  // boxes beyond `limit` are out; those beyond `tie` may lose to the smaller ids of equal distances
  const auto tighten = [&] {
    limit = static_cast<T>((1.0 + s) * results.bound().d2 + slack);
    tie = static_cast<T>((1.0 - s) * results.bound().d2);
  };
  tighten();

  constexpr int max_levels = 10;  // 16 * 8^10 > 2^32
  Entry stack[max_levels * (group_boxes - 1) + 1];
  int size = 0;
  const int root_level = static_cast<int>(levels_.size()) - 1;
  stack[size++] = {T(0), root_level, 0};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (!(entry.d2 <= limit)) continue;
    if (entry.d2 >= tie && entry.level < root_level && !(nearest_possible(entry, query) < results.bound())) continue;
    if (entry.level >= 0) {
      const BoxGroup<T>& group = levels_[static_cast<std::size_t>(entry.level)][entry.index];
      const typename BoxGroup<T>::Lanes d2 = group.squared_distances(q);
      const int bottom = size;
      for (unsigned mask = lanes_within(d2, limit) & group.used; mask != 0; mask &= mask - 1) {
        const int lane = lowest_lane(mask);
        int place = size++;
        for (; place > bottom && stack[place - 1].d2 <= d2[lane]; --place) stack[place] = stack[place - 1];
        stack[place] = {d2[lane], entry.level - 1, entry.index * group_boxes + static_cast<std::uint32_t>(lane)};
      }
    } else {
      const PointBlock<T>& block = blocks_[entry.index];
      const typename PointBlock<T>::Lanes d2 = block.squared_distances(q);
      for (unsigned mask = lanes_within(d2, limit); mask != 0; mask &= mask - 1) {
        const int lane = lowest_lane(mask);
        const double x = block.p[0][lane] - query.x(), y = block.p[1][lane] - query.y(),
                     z = block.p[2][lane] - query.z();
        results.add(
            {x * x + y * y + z * z, block.id[lane], entry.index * block_points + static_cast<std::uint32_t>(lane)});
      }
      tighten();
    }
  }
}

}  // namespace nacre
