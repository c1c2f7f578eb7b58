// The k-d tree's heir: points along a Hilbert curve in blocks of 16, under a hierarchy of bounding boxes with 16
// children each.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "base/buffer.hpp"
#include "base/numbers.hpp"
#include "simd/tree_hilbert_keys.hpp"
#include "simd/tree_layout.hpp"
#include "simd/tree_near_points.hpp"

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
    const double next = std::nextafter(square, infinity<double>);
    if (std::sqrt(next) > distance) break;
    square = next;
  }
  return square;
}

// The k nearest within a distance, in the caller's memory: kept sorted, for few.
class FewNearest {
 public:
  static constexpr std::int64_t room(int k) { return k; }
  FewNearest(int k, double bound_d2, Found* found)
      : bound_{bound_d2, no_id, no_id}, begin_(found), end_(found), full_(found + k) {}
  int num_wanted() const { return static_cast<int>(full_ - begin_); }
  const Found& bound() const { return bound_; }
  void add(const Found& point) {
    if (!(point < bound_)) return;
    if (end_ != full_) ++end_;
    Found* place = end_ - 1;
    for (; place != begin_ && point < place[-1]; --place) *place = place[-1];
    *place = point;
    if (end_ == full_) bound_ = end_[-1];
  }
  int finish() { return static_cast<int>(end_ - begin_); }

 private:
  Found bound_;
  Found *begin_, *end_, *full_;
};

// The same for many, for which making room in a sorted row takes longer: unsorted, and of twice as many the nearer half
// kept.
class ManyNearest {
 public:
  static constexpr std::int64_t room(int k) { return 2 * std::int64_t{k}; }
  ManyNearest(int k, double bound_d2, Found* found)
      : bound_{bound_d2, no_id, no_id}, begin_(found), end_(found), wanted_(found + k), full_(found + room(k)) {}
  int num_wanted() const { return static_cast<int>(wanted_ - begin_); }
  const Found& bound() const { return bound_; }
  void add(const Found& point) {
    if (!(point < bound_)) return;
    *end_++ = point;
    if (end_ == full_) keep_nearest();
  }
  int finish() {
    if (end_ > wanted_) keep_nearest();
    std::sort(begin_, end_);
    return static_cast<int>(end_ - begin_);
  }

 private:
  void keep_nearest() {
    std::nth_element(begin_, wanted_ - 1, end_);
    end_ = wanted_;
    bound_ = end_[-1];
  }

  Found bound_;
  Found *begin_, *end_, *wanted_, *full_;
};

// Everything within a distance, unsorted.
class WithinRadius {
 public:
  static int num_wanted() { return 0; }  // all
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

  // Shows results.add() every point that may be within results.bound().
  template <class Results>
  void search(const Eigen::Vector3d& query, Results& results) const;

 private:
  void build_blocks(const T* points, std::int64_t count, int num_threads);
  void build_groups(int num_threads);
  struct Blocks {
    std::uint32_t begin, end;
  };
  Blocks close_blocks(const Eigen::Vector3d& query, int num_points) const;
  template <class Results>
  bool search_within_bound(const Eigen::Vector3d& query, int most, Blocks seen, Results& results) const;
  template <class Results>
  void search_nearest_first(const Eigen::Vector3d& query, Blocks seen, Results& results) const;
  template <class Results>
  void show(const Eigen::Vector3d& query, std::uint32_t slot, Results& results) const;
  static Found nearest_possible(const BoxGroup<T>& group, int lane, const Eigen::Vector3d& query);

  std::int64_t num_points_ = 0;
  Buffer<PointBlock<T>> blocks_;
  Buffer<BoxGroup<T>> groups_;  // level after level, the groups over the blocks first, the root last
  BlockTreeView<T> view_ = {};
  simd::CurveCube<T> cube_ = {};
  std::vector<std::uint32_t> keys_;  // of the blocks' first points
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

// Where few points are within the bound, all are looked at. Else some that are close along the curve make it smaller.
template <class T>
template <class Results>
void BlockTree<T>::search(const Eigen::Vector3d& query, Results& results) const {
  if (num_points_ == 0 || !query.allFinite()) return;
  Blocks seen = {0, 0};
  if (results.num_wanted() > 0) {
    const int few = 4 * std::clamp(results.num_wanted(), 16, simd::most_near_points / 4);
    if (search_within_bound(query, few, seen, results)) return;
    seen = close_blocks(query, results.num_wanted());
    const std::int64_t end = std::min(num_points_, std::int64_t{seen.end} * block_points);
    for (std::int64_t slot = std::int64_t{seen.begin} * block_points; slot < end; ++slot) {
      show(query, static_cast<std::uint32_t>(slot), results);
    }
  }
  if (search_within_bound(query, simd::most_near_points, seen, results)) return;
  search_nearest_first(query, seen, results);
}

// The blocks around the query's place on the curve.
template <class T>
typename BlockTree<T>::Blocks BlockTree<T>::close_blocks(const Eigen::Vector3d& query, int num_points) const {
  const T q[3] = {static_cast<T>(query.x()), static_cast<T>(query.y()), static_cast<T>(query.z())};
  std::uint32_t key;
  if constexpr (std::is_same_v<T, float>) {
    key = simd::curve_key_f32()(q, cube_);
  } else {
    key = simd::curve_key_f64()(q, cube_);
  }
  const std::int64_t after = std::upper_bound(keys_.begin(), keys_.end(), key) - keys_.begin();
  const std::int64_t around = (num_points + block_points / 2) / block_points;
  const std::int64_t begin = std::max<std::int64_t>(after - 1 - around, 0);
  const std::int64_t end =
      std::min<std::int64_t>(std::max<std::int64_t>(after, 1) + around, static_cast<std::int64_t>(keys_.size()));
  return {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end)};
}

template <class T>
template <class Results>
void BlockTree<T>::show(const Eigen::Vector3d& query, std::uint32_t slot, Results& results) const {
  const PointBlock<T>& block = blocks_[slot / block_points];
  const auto lane = slot % block_points;
  const double x = block.p[0][lane] - query.x(), y = block.p[1][lane] - query.y(), z = block.p[2][lane] - query.z();
  results.add({x * x + y * y + z * z, block.id[lane], slot});
}

// False where more points are within the bound.
template <class T>
template <class Results>
bool BlockTree<T>::search_within_bound(const Eigen::Vector3d& query, int most, Blocks seen, Results& results) const {
  std::uint32_t slots[simd::most_near_points + 16];
  int size;
  if constexpr (std::is_same_v<T, float>) {
    size = simd::near_points_f32()(view_, query.data(), results.bound().d2, most, slots);
  } else {
    size = simd::near_points_f64()(view_, query.data(), results.bound().d2, most, slots);
  }
  for (int i = 0; i < size; ++i) {
    const std::uint32_t block = slots[i] / block_points;
    if (block < seen.begin || block >= seen.end) show(query, slots[i], results);
  }
  return size >= 0;
}

// Filters in the precision of the coordinates and decides in double: a lane passes where its distance in T is not above
// a slightly enlarged bound, then its exact distance is compared.
template <class T>
template <class Results>
void BlockTree<T>::search_nearest_first(const Eigen::Vector3d& query, Blocks seen, Results& results) const {
  simd::NearBoxes<T>* near_boxes;
  simd::PointDistances<T>* point_distances;
  if constexpr (std::is_same_v<T, float>) {
    near_boxes = simd::near_boxes_f32();
    point_distances = simd::point_distances_f32();
  } else {
    near_boxes = simd::near_boxes_f64();
    point_distances = simd::point_distances_f64();
  }
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

  // The boxes still to visit, the nearest of each group on top of the others; opening one adds up to 15 more.
  // Above its number is a box's level.
  constexpr int level_bits = 28, room = BlockTreeView<T>::most_levels * (group_boxes - 1) + 1 + group_boxes;
  T distances[room];
  std::uint32_t boxes[room];
  int size = 0;
  const auto open = [&](int level, std::uint32_t number) {
    const auto first = static_cast<std::uint32_t>(level) << level_bits | number * group_boxes;
    size += near_boxes(view_.levels[level][number], q, limit, first, boxes + size, distances + size);
  };

  open(view_.num_levels - 1, 0);
  while (size > 0) {
    --size;
    const T distance = distances[size];
    if (distance > limit) continue;
    const auto level = static_cast<int>(boxes[size] >> level_bits);
    const std::uint32_t box = boxes[size] & ((1U << level_bits) - 1);
    if (!(distance < tie)) {  // as where the tie is NaN: squares that are no floats
      const BoxGroup<T>& group = view_.levels[level][box / group_boxes];
      if (!(nearest_possible(group, static_cast<int>(box % group_boxes), query) < results.bound())) continue;
    }
    if (level > 0) {
      open(level - 1, box);
      continue;
    }
    if (box >= seen.begin && box < seen.end) continue;
    for (unsigned mask = point_distances(blocks_[box], q, limit); mask != 0; mask &= mask - 1) {
      show(query, box * block_points + static_cast<std::uint32_t>(simd::lowest_bit(mask)), results);
    }
    tighten();
  }
}

constexpr int few_neighbors = 32;

// How many places find_nearest() needs.
inline std::int64_t room_for_nearest(std::int64_t num_points, int k) {
  const auto most = static_cast<int>(std::min<std::int64_t>(k, num_points));
  return most <= few_neighbors ? FewNearest::room(most) : ManyNearest::room(most);
}

// Writes the k nearest within a distance, sorted; returns how many there are.
template <class T>
int find_nearest(const BlockTree<T>& tree, const Eigen::Vector3d& query, int k, double bound_d2, Found* found) {
  const auto find = [&](auto nearest) {
    tree.search(query, nearest);
    return nearest.finish();
  };
  const auto most = static_cast<int>(std::min<std::int64_t>(k, tree.num_points()));
  return most <= few_neighbors ? find(FewNearest(most, bound_d2, found)) : find(ManyNearest(most, bound_d2, found));
}

}  // namespace nacre
