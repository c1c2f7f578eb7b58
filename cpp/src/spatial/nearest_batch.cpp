#include "spatial/nearest_batch.hpp"

#include <cmath>

#include "base/numbers.hpp"

namespace nacre {
namespace {

float squared_distance(const BlockTree<float>& tree, std::uint32_t slot, float x, float y, float z) {
  const PointBlock<float>& block = tree.view().blocks[slot / block_points];
  const auto lane = slot % block_points;
  const float dx = x - block.p[0][lane], dy = y - block.p[1][lane], dz = z - block.p[2][lane];
  return dx * dx + dy * dy + dz * dz;
}

// The nearest point in float, found by a search that is exact.
class NearestInFloat {
 public:
  static int num_wanted() { return 1; }
  NearestInFloat(const BlockTree<float>& tree, float x, float y, float z, float largest2)
      : tree_(tree), x_(x), y_(y), z_(z) {
    set_bound(largest2);
  }
  const Found& bound() const { return bound_; }
  void add(const Found& found) {
    const float d2 = squared_distance(tree_, found.slot, x_, y_, z_);
    if (!(d2 < d2_ || (d2 == d2_ && found.slot < slot_))) return;
    slot_ = found.slot;
    set_bound(d2);
  }
  std::uint32_t slot() const { return slot_; }
  float d2() const { return d2_; }

 private:
  void set_bound(float d2) {
    constexpr double rounding = 1.000001;
    d2_ = d2;
    bound_ = {static_cast<double>(d2) * rounding + std::numeric_limits<float>::min(), no_id, no_id};
  }

  const BlockTree<float>& tree_;
  float x_, y_, z_, d2_ = infinity<float>;
  std::uint32_t slot_ = no_slot;
  Found bound_ = {};
};

class Search {
 public:
  Search(const BlockTree<float>& tree, const NearestPoints& queries, double max_distance)
      : tree_(tree), queries_(queries), largest2_(static_cast<float>(max_distance * max_distance)) {}

  void operator()(std::int64_t begin, std::int64_t end) {
    while (begin < end) {
      const int size = static_cast<int>(std::min<std::int64_t>(group_size_, end - begin));
      std::int64_t rows[16];
      float radius2 = 0;
      for (int i = 0; i < size; ++i) {
        rows[i] = begin + i;
        radius2 = std::max(radius2, likely_bound(begin + i));
      }
      farthest2_ = 0;
      answer(rows, size, radius2);
      begin += size;
    }
  }

 private:
  // A squared distance that some point is, or is likely to be, within.
  float likely_bound(std::int64_t row) const {
    const std::uint32_t slot = queries_.slots[row];
    if (slot != no_slot) return squared_distance(tree_, slot, queries_.x[row], queries_.y[row], queries_.z[row]);
    return farthest2_ > 0 ? 2 * farthest2_ : nearest_alone(row).d2();
  }

  NearestInFloat nearest_alone(std::int64_t row) const {
    NearestInFloat nearest(tree_, queries_.x[row], queries_.y[row], queries_.z[row], largest2_);
    tree_.search({queries_.x[row], queries_.y[row], queries_.z[row]}, nearest);
    return nearest;
  }

  void answer(const std::int64_t* rows, int size, float radius2) {
    simd::PointGroup group;
    group.size = size;
    group.radius2 = std::min(radius2, largest2_);
    for (int i = 0; i < 16; ++i) {
      const std::int64_t row = rows[i < size ? i : 0];
      group.x[i] = queries_.x[row];
      group.y[i] = queries_.y[row];
      group.z[i] = queries_.z[row];
    }
    simd::nearest_points()(tree_.view(), group);
    if (group.crowded && size > 1) {
      group_size_ = size / 2;
      answer(rows, size / 2, radius2);
      answer(rows + size / 2, size - size / 2, radius2);
      return;
    }
    adapt(size, group.num_candidates);
    std::int64_t left[16];
    int num_left = 0;
    for (int i = 0; i < size; ++i) {
      const bool found = !group.crowded && group.squared_distance[i] < infinity<float>;
      if (found || (!group.crowded && radius2 >= largest2_)) {
        write(rows[i], found ? group.slot[i] : no_slot, group.squared_distance[i], group.next[i]);
      } else if (group.crowded || size == 1) {
        const NearestInFloat nearest = nearest_alone(rows[i]);
        const bool any = nearest.slot() != no_slot;
        write(rows[i], nearest.slot(), any ? nearest.d2() : infinity<float>, nearest.d2());
      } else {
        left[num_left++] = rows[i];
      }
    }
    if (num_left > 0) answer(left, num_left, 4 * radius2);
  }

  // Queries far from each other are answered faster alone.
  void adapt(int size, int num_candidates) {
    if (size == 1) {
      if (++num_alone_ % 64 == 0) group_size_ = 2;
    } else if (300 + 8 * num_candidates > 450 * size) {
      group_size_ = size / 2;
    } else if (300 + 16 * num_candidates < 450 * size) {
      group_size_ = std::min(16, 2 * size);
    }
  }

  void write(std::int64_t row, std::uint32_t slot, float d2, float next) {
    queries_.slots[row] = slot;
    queries_.squared_distances[row] = d2;
    if (queries_.next != nullptr) queries_.next[row] = next;
    if (slot != no_slot) farthest2_ = std::max(farthest2_, d2);
  }

  const BlockTree<float>& tree_;
  const NearestPoints& queries_;
  float largest2_;
  float farthest2_ = 0;  // of the group's answers
  int group_size_ = 16, num_alone_ = 0;
};

}  // namespace

void find_nearest_points(const BlockTree<float>& tree, const NearestPoints& queries, std::int64_t begin,
                         std::int64_t end, double max_distance) {
  if (tree.num_points() == 0) {
    std::fill(queries.slots + begin, queries.slots + end, no_slot);
    std::fill(queries.squared_distances + begin, queries.squared_distances + end, infinity<float>);
    if (queries.next != nullptr) std::fill(queries.next + begin, queries.next + end, infinity<float>);
    return;
  }
  Search(tree, queries, max_distance)(begin, end);
}

}  // namespace nacre
