// The nearest point of queries in float, side by side: one vector for up to 16 of them against one candidate at a time,
// 11 operations for as many distances as lanes; 30 ns a query for 100,000 of them among as many points, where the last
// answer gives the radius. A query on its own walks the tree, and sees blocks of 16 points at once: 130 ns.
#include "simd/tree_nearest_point.hpp"

#include "simd/tree_group_search.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

// Blocks that may hold a point within the radius, and the squared distances to their boxes.
struct NearBlocks {
  static constexpr int most = 1024;
  alignas(64) int32_t number[most + group_boxes];
  alignas(64) float d2[most + group_boxes];
  int count;
};

NACRE_INLINE F32 box_distances(const BoxGroup<float>& group, int lane, F32 x, F32 y, F32 z) {
  const F32 zero = broadcast(0.0F);
  // NaN, which is near nothing, where the query is.
  const F32 dx = max(zero, max(load(group.lo[0] + lane) - x, x - load(group.hi[0] + lane)));
  const F32 dy = max(zero, max(load(group.lo[1] + lane) - y, y - load(group.hi[1] + lane)));
  const F32 dz = max(zero, max(load(group.lo[2] + lane) - z, z - load(group.hi[2] + lane)));
  return dx * dx + dy * dy + dz * dz;
}

NACRE_INLINE bool find_near_blocks(const BlockTreeView<float>& tree, F32 x, F32 y, F32 z, float limit,
                                   NearBlocks& out) {
  int32_t others[NearBlocks::most + group_boxes];
  int32_t* boxes = tree.num_levels % 2 == 0 ? out.number : others;
  int32_t* below = tree.num_levels % 2 == 0 ? others : out.number;
  boxes[0] = 0;
  out.count = 1;
  if (!(limit < FLT_MAX)) limit = FLT_MAX;  // boxes that do not exist are at infinity
  for (int level = tree.num_levels - 1; level >= 0; --level) {
    int n = 0;
    for (int i = 0; i < out.count; ++i) {
      const BoxGroup<float>& group = tree.levels[level][boxes[i]];
      for (int lane = 0; lane < group_boxes; lane += lanes) {
        const F32 d2 = box_distances(group, lane, x, y, z);
        const Mask near = d2 <= broadcast(limit);
        store_chosen(below + n, near, lane_numbers() + broadcast(boxes[i] * group_boxes + lane));
        if (level == 0) store_chosen(out.d2 + n, near, d2);
        n += count(near);
      }
      if (n > NearBlocks::most) return false;
    }
    int32_t* const swap = boxes;
    boxes = below;
    below = swap;
    out.count = n;
  }
  return true;
}

// Of every lane the least distance, where it is, and the second least.
struct Nearest {
  F32 least, next;
  I32 slot;
};

NACRE_INLINE void look_at(const BlockTreeView<float>& tree, int32_t number, F32 x, F32 y, F32 z, Nearest& found) {
  const PointBlock<float>& block = tree.blocks[number];
  for (int lane = 0; lane < block_points; lane += lanes) {
    const F32 dx = x - load(block.p[0] + lane), dy = y - load(block.p[1] + lane), dz = z - load(block.p[2] + lane);
    const F32 d2 = dx * dx + dy * dy + dz * dz;
    const I32 slot = lane_numbers() + broadcast(number * block_points + lane);
    // (Unsigned places in signed lanes: only ties beyond 2^31 points notice.)
    const Mask nearer = (d2 < found.least) | ((d2 == found.least) & (slot < found.slot));
    found.next = min(max(d2, found.least), found.next);
    found.least = select(nearer, d2, found.least);
    found.slot = select(nearer, slot, found.slot);
  }
}

void nearest_alone(const BlockTreeView<float>& tree, PointGroup& group) {
  const F32 x = broadcast(group.x[0]), y = broadcast(group.y[0]), z = broadcast(group.z[0]);
  NearBlocks blocks;
  group.crowded = !find_near_blocks(tree, x, y, z, group.radius2 * 1.000001F, blocks);
  if (group.crowded) return;
  Nearest found = {broadcast(INFINITY), broadcast(INFINITY), broadcast(INT32_MAX)};
  int first = 0;
  for (int i = 1; i < blocks.count; ++i) first = blocks.d2[i] < blocks.d2[first] ? i : first;
  float least = INFINITY, beyond = group.radius2;
  if (blocks.count > 0) {
    look_at(tree, blocks.number[first], x, y, z, found);  // NOLINT(clang-analyzer-core.CallAndMessage): counted
    least = least_of(found.least);
  }
  for (int i = 0; i < blocks.count; ++i) {
    if (i == first) continue;
    if (blocks.d2[i] > least * 1.000001F) {
      beyond = blocks.d2[i] < beyond ? blocks.d2[i] : beyond;
      continue;
    }
    look_at(tree, blocks.number[i], x, y, z, found);
    least = least_of(found.least);
  }
  group.squared_distance[0] = least <= group.radius2 ? least : INFINITY;
  group.next[0] = group.radius2;
  if (!(least <= group.radius2)) return;
  const Mask at_least = found.least == broadcast(least);
  const int32_t slot = least_lane(select(at_least, found.slot, broadcast(INT32_MAX)));
  group.slot[0] = static_cast<uint32_t>(slot);
  const Mask is_nearest = at_least & (found.slot == broadcast(slot));
  const float next = least_of(min(select(is_nearest, broadcast(INFINITY), found.least), found.next));
  group.next[0] = next < beyond ? next : beyond;
}

void nearest_together(const BlockTreeView<float>& tree, PointGroup& group) {
  double queries[3][group_queries];
  for (int i = 0; i < group_queries; ++i) {
    queries[0][i] = group.x[i];
    queries[1][i] = group.y[i];
    queries[2][i] = group.z[i];
  }
  GroupFrame<float> frame;
  Candidates candidates;
  group.crowded = !make_frame(queries, group.size, static_cast<double>(group.radius2), frame) ||
                  !collect<Position::own>(tree, frame, candidates);
  if (group.crowded) return;
  group.num_candidates = candidates.count;

  const float radius2 = group.radius2;
  for (int query = 0; query < group.size; query += lanes) {
    const F32 x = load(group.x + query), y = load(group.y + query), z = load(group.z + query);
    F32 least = broadcast(INFINITY), next = broadcast(radius2);
    I32 nearest = broadcast(0);
    for (int i = 0; i < candidates.count; ++i) {
      const F32 dx = x - broadcast(candidates.p[0][i]), dy = y - broadcast(candidates.p[1][i]);
      const F32 dz = z - broadcast(candidates.p[2][i]);
      const F32 d2 = dx * dx + dy * dy + dz * dz;
      const Mask nearer = d2 < least;
      next = min(next, max(least, d2));
      least = select(nearer, d2, least);
      nearest = select(nearer, broadcast(i), nearest);
    }
    const Mask within = least <= broadcast(radius2);
    next = select(within, next, broadcast(radius2));
    store(group.squared_distance + query, select(within, least, broadcast(INFINITY)));
    store(group.next + query, next);
    int32_t index[lanes];
    store(index, nearest);
    for (int i = 0; i < lanes; ++i) group.slot[query + i] = static_cast<uint32_t>(candidates.slot[index[i]]);
  }
}

}  // namespace

void nearest_points(const BlockTreeView<float>& tree, PointGroup& group) {
  group.size == 1 ? nearest_alone(tree, group) : nearest_together(tree, group);
}

}  // namespace nacre::simd::NACRE_ISA
