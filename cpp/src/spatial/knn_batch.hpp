// The k nearest of queries, 16 at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "base/numbers.hpp"
#include "simd/tree_nearest_group.hpp"
#include "spatial/bvh16.hpp"

namespace nacre {

inline void nearest_group(const BlockTreeView<float>& tree, const simd::NearestTask& task, simd::QueryGroup& group) {
  simd::nearest_group_f32()(tree, task, group);
}
inline void nearest_group(const BlockTreeView<double>& tree, const simd::NearestTask& task, simd::QueryGroup& group) {
  simd::nearest_group_f64()(tree, task, group);
}
inline void nearest_group(const BlockTreeView<float>& tree, const simd::NearestSlotsTask& task,
                          simd::QueryGroup& group) {
  simd::nearest_slots_f32()(tree, task, group);
}
inline void nearest_group(const BlockTreeView<double>& tree, const simd::NearestSlotsTask& task,
                          simd::QueryGroup& group) {
  simd::nearest_slots_f64()(tree, task, group);
}

inline void write_answer(const simd::NearestTask& task, std::uint32_t row, const Found* found, int count) {
  const std::int64_t start = static_cast<std::int64_t>(row) * task.k;
  for (int j = 0; j < task.k; ++j) {
    const double distance = j < count ? std::sqrt(found[j].d2) : infinity<double>;
    task.indices[start + j] = j < count ? found[j].id : task.missing;
    if (task.distances != nullptr) {
      task.distances[start + j] = distance;
    } else {
      task.float_distances[start + j] = static_cast<float>(distance);
    }
  }
}
inline void write_answer(const simd::NearestSlotsTask& task, std::uint32_t row, const Found* found, int count) {
  for (int j = 0; j < count; ++j) task.slots[static_cast<std::int64_t>(row) * task.k + j] = found[j].slot;
  task.counts[row] = count;
}

// How many queries a thread takes at once, `most` where neighbours are few: a call is asked to stop between them.
inline std::int64_t queries_per_task(int k, std::int64_t most) {
  constexpr std::int64_t most_neighbors = 1 << 16;
  return std::clamp<std::int64_t>(most_neighbors / k / block_points * block_points, block_points, most);
}

// Answers group after group of queries that are close together. The radius within which a group finds its neighbours is
// not known before: it is guessed from the group before, and enlarged for queries that it is too small for.
template <class T, class Task>
class GroupQueries {
 public:
  GroupQueries(const BlockTree<T>& tree, const Task& task)
      : tree_(tree),
        task_(task),
        // Whatever is within the largest distance is within this radius, in spite of rounding.
        largest2_(1.0001 * task.max_distance2 + std::numeric_limits<double>::min()),
        found_(static_cast<std::size_t>(room_for_nearest(tree.num_points(), task.k))) {}

  void operator()(simd::QueryGroup& group) {
    if (task_.k > simd::most_group_neighbors || task_.k > tree_.num_points()) {
      farthest2_ = 0;
      for (int i = 0; i < group.size; ++i) answer_alone(group, i);
      last2_ = farthest2_;
      return;
    }
    if (!(last2_ > 0) && group.size > 0) {
      farthest2_ = 0;
      answer_alone(group, 0);
      last2_ = farthest2_;
    }
    farthest2_ = 0;
    answer(group, 1.7 * last2_);
    last2_ = farthest2_;
  }

 private:
  void answer(simd::QueryGroup& group, double radius2) {
    constexpr int most_attempts = 8;
    for (int attempt = 0; group.size > 0 && attempt < most_attempts; ++attempt) {
      group.radius2 = std::min(radius2, largest2_);
      nearest_group(tree_.view(), task_, group);
      farthest2_ = std::max(farthest2_, group.farthest2);
      if (group.crowded) {
        if (group.size == 1) break;
        simd::QueryGroup half = part(group, 0, group.size / 2), rest = part(group, group.size / 2, group.size);
        answer(half, radius2);
        answer(rest, radius2);
        return;
      }
      if (radius2 >= largest2_) break;
      radius2 *= 2.5;
    }
    for (int i = 0; i < group.size; ++i) answer_alone(group, i);
  }

  static simd::QueryGroup part(const simd::QueryGroup& group, int begin, int end) {
    simd::QueryGroup some = {};
    for (some.size = 0; begin + some.size < end; ++some.size) {
      const int lane = some.size, from = begin + lane;
      for (int axis = 0; axis < 3; ++axis) some.p[axis][lane] = group.p[axis][from];
      some.row[lane] = group.row[from];
    }
    return some;
  }

  void answer_alone(const simd::QueryGroup& group, int i) {
    const Eigen::Vector3d query(group.p[0][i], group.p[1][i], group.p[2][i]);
    const double likely2 = std::min(1.3 * std::max(last2_, farthest2_), task_.max_distance2);
    int count = find_nearest(tree_, query, task_.k, likely2, found_.data());
    if (count < task_.k && likely2 < task_.max_distance2) {
      count = find_nearest(tree_, query, task_.k, task_.max_distance2, found_.data());
    }
    if (count == task_.k) farthest2_ = std::max(farthest2_, found_[static_cast<std::size_t>(count) - 1].d2);
    write_answer(task_, group.row[i], found_.data(), count);
  }

  const BlockTree<T>& tree_;
  const Task& task_;
  double largest2_;
  std::vector<Found> found_;
  double last2_ = 0, farthest2_ = 0;  // the largest squared distances to a k-th neighbour, of the last group and this
};

}  // namespace nacre
