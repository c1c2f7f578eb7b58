// d2 = (p - q)^2 of every candidate in float, then of the nearest in double. For k = 16 among 100,000 points of a noisy
// surface a query takes 90 ns (AVX-512, Zen 5): 28 to collect candidates for the group, 25 to rank them, 33 for exact
// distances, 4 to write them.
#include "simd/tree_nearest_group.hpp"

#include "simd/tree_rank_candidates.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

struct Row {
  alignas(64) double d2[most_near];
  uint32_t id[most_near], slot[most_near];
};

// The exact squared distances of the first candidates in the ranking, put in order.
template <class T>
NACRE_INLINE void exact_row(const BlockTreeView<T>& tree, const Candidates& candidates, const Ranking& ranking,
                            const double (&queries)[3][group_queries], int query, int count, Row& row) {
  const double x = queries[0][query], y = queries[1][query], z = queries[2][query];
  double last = -1.0;
  bool in_order = true;
  for (int rank = 0; rank < count; ++rank) {
    const auto slot = static_cast<uint32_t>(candidates.slot[ranking.keys[rank][query] & (most_candidates - 1)]);
    const PointBlock<T>& block = tree.blocks[slot / block_points];
    const uint32_t lane = slot % block_points;
    const double dx = static_cast<double>(block.p[0][lane]) - x, dy = static_cast<double>(block.p[1][lane]) - y;
    const double dz = static_cast<double>(block.p[2][lane]) - z;
    const double d2 = dx * dx + dy * dy + dz * dz;
    row.d2[rank] = d2;
    row.id[rank] = block.id[lane];
    row.slot[rank] = slot;
    in_order &= last < d2;
    last = d2;
  }
  if (in_order) return;
  for (int rank = 1; rank < count; ++rank) {
    const double d2 = row.d2[rank];
    const uint32_t id = row.id[rank], slot = row.slot[rank];
    int place = rank;
    for (; place > 0 && (d2 < row.d2[place - 1] || (d2 == row.d2[place - 1] && id < row.id[place - 1])); --place) {
      row.d2[place] = row.d2[place - 1];
      row.id[place] = row.id[place - 1];
      row.slot[place] = row.slot[place - 1];
    }
    row.d2[place] = d2;
    row.id[place] = id;
    row.slot[place] = slot;
  }
}

template <class Distance>
NACRE_INLINE void write_row(const Row& row, int count, int k, int64_t missing, int64_t* indices, Distance* distances) {
  for (int rank = 0; rank < count; ++rank) {
    indices[rank] = row.id[rank];
    distances[rank] = static_cast<Distance>(::sqrt(row.d2[rank]));
  }
  for (int rank = count; rank < k; ++rank) {
    indices[rank] = missing;
    distances[rank] = static_cast<Distance>(INFINITY);
  }
}

void write(const NearestTask& task, const Row& row, int count, uint32_t to) {
  const int64_t start = static_cast<int64_t>(to) * task.k;
  if (task.distances != nullptr) {
    write_row(row, count, task.k, task.missing, task.indices + start, task.distances + start);
  } else {
    write_row(row, count, task.k, task.missing, task.indices + start, task.float_distances + start);
  }
}

void write(const NearestSlotsTask& task, const Row& row, int count, uint32_t to) {
  for (int rank = 0; rank < count; ++rank) task.slots[static_cast<int64_t>(to) * task.k + rank] = row.slot[rank];
  task.counts[to] = count;
}

// The rows to write are anywhere in memory: asked for now, they have arrived when the answers are known.
NACRE_INLINE void prefetch(const void* begin, const void* end) {
#if !defined(_MSC_VER) || defined(__clang__)
  for (const char* p = static_cast<const char*>(begin); p < end; p += 64) __builtin_prefetch(p, 1);
  __builtin_prefetch(static_cast<const char*>(end) - 1, 1);
#endif
}
NACRE_INLINE void prefetch_row(const NearestTask& task, uint32_t row) {
  const int64_t start = static_cast<int64_t>(row) * task.k;
  prefetch(task.indices + start, task.indices + start + task.k);
  if (task.distances != nullptr) {
    prefetch(task.distances + start, task.distances + start + task.k);
  } else {
    prefetch(task.float_distances + start, task.float_distances + start + task.k);
  }
}
NACRE_INLINE void prefetch_row(const NearestSlotsTask&, uint32_t) {}

// Writes the answer if it is certain: everything that was not looked at is farther than the last neighbour, or than the
// largest distance.
template <class T, class Task>
NACRE_INLINE bool write_answer(const GroupFrame<T>& frame, const Ranking& ranking, const Task& task, int query,
                               int looked_at, const Row& row, QueryGroup& group) {
  if (looked_at < 0) return false;
  int n = looked_at < task.k ? looked_at : task.k;
  double last2 = task.max_distance2;
  if (n == task.k && row.d2[n - 1] < last2) last2 = row.d2[n - 1];
  const auto scale = static_cast<double>(frame.scale);
  if (!(last2 * scale * scale < beyond_rank(frame, ranking, query, looked_at))) return false;
  while (n > 0 && row.d2[n - 1] > task.max_distance2) --n;
  if (n == task.k && last2 > group.farthest2) group.farthest2 = last2;
  write(task, row, n, group.row[query]);
  return true;
}

template <class T, class Task>
void nearest(const BlockTreeView<T>& tree, const Task& task, QueryGroup& group) {
  group.farthest2 = 0;
  group.crowded = false;
  for (int query = 0; query < group.size; ++query) prefetch_row(task, group.row[query]);
  GroupFrame<T> frame;
  if (!make_frame(group.p, group.size, group.radius2, frame)) return;
  Candidates candidates;
  if (!collect<Position::local>(tree, frame, candidates)) {
    group.crowded = true;
    return;
  }
  Ranking ranking;
  rank_candidates(frame, candidates, group.size, task.k, ranking);

  // In steps for the whole group, so that vectors are not loaded from what has just been stored piece by piece.
  Row rows[group_queries];
  int looked_at[group_queries];
  for (int query = 0; query < group.size; ++query) {
    looked_at[query] = ranked_closely(frame, ranking, query, task.k);
    if (looked_at[query] > 0) exact_row(tree, candidates, ranking, group.p, query, looked_at[query], rows[query]);
  }
  int left = 0;
  for (int query = 0; query < group.size; ++query) {
    if (write_answer(frame, ranking, task, query, looked_at[query], rows[query], group)) continue;
    group.crowded = group.crowded || looked_at[query] < 0;
    for (int axis = 0; axis < 3; ++axis) group.p[axis][left] = group.p[axis][query];
    group.row[left++] = group.row[query];
  }
  group.size = left;
}

}  // namespace

void nearest_group_f32(const BlockTreeView<float>& tree, const NearestTask& task, QueryGroup& group) {
  nearest(tree, task, group);
}
void nearest_group_f64(const BlockTreeView<double>& tree, const NearestTask& task, QueryGroup& group) {
  nearest(tree, task, group);
}

void nearest_slots_f32(const BlockTreeView<float>& tree, const NearestSlotsTask& task, QueryGroup& group) {
  nearest(tree, task, group);
}
void nearest_slots_f64(const BlockTreeView<double>& tree, const NearestSlotsTask& task, QueryGroup& group) {
  nearest(tree, task, group);
}

}  // namespace nacre::simd::NACRE_ISA
