// The k-d tree's heir: points along a Hilbert curve in blocks of 16, under a hierarchy of bounding boxes with 16
// children each.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "buffer.hpp"
#include "simd/block_layout.hpp"

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

template <class T>
class BlockTree {
 public:
  // `count` rows of three coordinates; those that are not finite are left out.
  BlockTree(const T* points, std::int64_t count, int num_threads);

  // The finite points, numbered by their places in the tree.
  std::int64_t num_points() const { return num_points_; }
  std::uint32_t id(std::uint32_t slot) const { return blocks_[slot / block_points].id[slot % block_points]; }
  Eigen::Vector3d position(std::uint32_t slot) const {
    const PointBlock<T>& block = blocks_[slot / block_points];
    const auto lane = slot % block_points;
    return {block.p[0][lane], block.p[1][lane], block.p[2][lane]};
  }
  const BlockTreeView<T>& view() const { return view_; }

  // Shows results.add() every point that may be within results.bound(), mostly near ones first.
  template <class Results>
  void search(const Eigen::Vector3d& query, Results& results) const;

 private:
  using Lanes = Eigen::Array<T, group_boxes, 1>;
  using LanesMap = Eigen::Map<const Lanes, Eigen::Aligned16>;

  void build_blocks(const T* points, std::int64_t count, int num_threads);
  void build_groups(int num_threads);
  static Lanes squared_distances(const BoxGroup<T>& group, const T* q);
  static Lanes squared_distances(const PointBlock<T>& block, const T* q);
  static Found nearest_possible(const BoxGroup<T>& group, int lane, const Eigen::Vector3d& query);

  std::int64_t num_points_ = 0;
  Buffer<PointBlock<T>> blocks_;
  Buffer<BoxGroup<T>> groups_;  // level after level, the groups over the blocks first, the root last
  BlockTreeView<T> view_ = {};
};

// No point of the box comes before this one: rounding is monotonic, so the box's distance is not above any of theirs.
template <class T>
Found BlockTree<T>::nearest_possible(const BoxGroup<T>& group, int lane, const Eigen::Vector3d& query) {
  double outside[3];
  for (int axis = 0; axis < 3; ++axis) {
    outside[axis] = std::max({0.0, group.lo[axis][lane] - query[axis], query[axis] - group.hi[axis][lane]});
  }
  return {outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2], group.first_id[lane], no_id};
}

// The sum over the axes of max(0, lo - q, q - hi)^2.
template <class T>
typename BlockTree<T>::Lanes BlockTree<T>::squared_distances(const BoxGroup<T>& group, const T* q) {
  const auto gap = [&](int axis) {
    return (LanesMap(group.lo[axis]) - q[axis]).max(q[axis] - LanesMap(group.hi[axis])).max(T(0));
  };
  return gap(0).square() + gap(1).square() + gap(2).square();
}

template <class T>
typename BlockTree<T>::Lanes BlockTree<T>::squared_distances(const PointBlock<T>& block, const T* q) {
  const auto step = [&](int axis) { return q[axis] - LanesMap(block.p[axis]); };
  return step(0).square() + step(1).square() + step(2).square();
}

// Filters in the precision of the coordinates and decides in double: a lane passes where its distance in T is not above
// a slightly enlarged bound, then its exact distance is compared.
template <class T>
template <class Results>
void BlockTree<T>::search(const Eigen::Vector3d& query, Results& results) const {
  if (num_points_ == 0 || !query.allFinite()) return;
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

  // The boxes still to visit, nearest on top; opening one adds up to 15 more.
  struct Visit {
    T d2;
    int level;  // of its group
    std::uint32_t box;
  };
  Visit visits[BlockTreeView<T>::most_levels * (group_boxes - 1) + 1];
  int size = 0;
  const auto open = [&](int level, std::uint32_t number) {
    const Lanes d2 = squared_distances(view_.levels[level][number], q);
    const int bottom = size;
    for (int lane = 0; lane < group_boxes; ++lane) {
      if (!(d2[lane] <= limit)) continue;
      int place = size++;
      for (; place > bottom && visits[place - 1].d2 <= d2[lane]; --place) visits[place] = visits[place - 1];
      visits[place] = {d2[lane], level, number * group_boxes + static_cast<std::uint32_t>(lane)};
    }
  };

  open(view_.num_levels - 1, 0);
  while (size > 0) {
    const Visit visit = visits[--size];
    if (visit.d2 > limit) continue;
    if (visit.d2 >= tie) {
      const BoxGroup<T>& group = view_.levels[visit.level][visit.box / group_boxes];
      if (!(nearest_possible(group, static_cast<int>(visit.box % group_boxes), query) < results.bound())) continue;
    }
    if (visit.level > 0) {
      open(visit.level - 1, visit.box);
      continue;
    }
    const PointBlock<T>& block = blocks_[visit.box];
    const Lanes d2 = squared_distances(block, q);
    for (int lane = 0; lane < block_points; ++lane) {
      if (!(d2[lane] <= limit)) continue;
      const double x = block.p[0][lane] - query.x(), y = block.p[1][lane] - query.y(), z = block.p[2][lane] - query.z();
      results.add({x * x + y * y + z * z, block.id[lane], visit.box * block_points + static_cast<std::uint32_t>(lane)});
    }
    tighten();
  }
}

}  // namespace nacre
