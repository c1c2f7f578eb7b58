#include "consolidation/point_blocks.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "simd/wlop_block_bounds.hpp"
#include "spatial/hilbert_order.hpp"

namespace nacre {
namespace {

constexpr float largest = std::numeric_limits<float>::max();
constexpr std::int64_t nodes_per_task = 4;

// The nearest float that is not greater, or not smaller, within a unit in the last place. Finite, for infinities would
// make boxes that do not exist look near; where there is no number, the box has no end.
float round_down(double x) {
  const double rounded = x - std::abs(x) * 1.2e-7;
  return rounded > -largest ? static_cast<float>(std::min(rounded, double{largest})) : -largest;
}
float round_up(double x) {
  const double rounded = x + std::abs(x) * 1.2e-7;
  return rounded < largest ? static_cast<float>(std::max(rounded, -double{largest})) : largest;
}

template <class T>
struct Place {
  T point[3];
  std::uint32_t row;
};

template <class T>
bool is_near(const Place<T>& a, const Place<T>& b, double distance) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(static_cast<double>(a.point[axis]) - static_cast<double>(b.point[axis])) <= distance)) return false;
  }
  return true;
}

// Halves along the longest side of the box, over and over, into blocks; all but the last are full.
template <class T>
void halve(Place<T>* first, Place<T>* last) {
  const std::int64_t num_blocks = (last - first + PointBlocks::size - 1) / PointBlocks::size;
  if (num_blocks <= 1) return;
  int longest = 0;
  T length = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto less = [axis](const Place<T>& a, const Place<T>& b) { return a.point[axis] < b.point[axis]; };
    const auto ends = std::minmax_element(first, last, less);
    if (!(ends.second->point[axis] - ends.first->point[axis] > length)) continue;
    length = ends.second->point[axis] - ends.first->point[axis];
    longest = axis;
  }
  Place<T>* const middle = first + num_blocks / 2 * PointBlocks::size;
  std::nth_element(first, middle, last,
                   [longest](const Place<T>& a, const Place<T>& b) { return a.point[longest] < b.point[longest]; });
  halve(first, middle);
  halve(middle, last);
}

}  // namespace

template <class T>
BlockRows block_rows(const Rows<T>& points, double longest, bool halved, int num_threads) {
  SpatialOrder<T> order(points.data(), points.size(), num_threads);
  BlockRows blocks;
  blocks.rows.resize(as_size(order.size()));
  std::vector<std::uint8_t> is_first(as_size(order.size()), 0);
  order.for_each_stretch(num_threads, [&](std::int64_t first, const std::uint64_t* entries, std::int64_t count) {
    std::vector<Place<T>> places(as_size(count));
    for (std::int64_t i = 0; i < count; ++i) {
      Place<T>& place = places[as_size(i)];
      place.row = SpatialOrder<T>::row(entries[i]);
      std::copy_n(points[place.row], 3, place.point);
    }
    if (halved) halve(places.data(), places.data() + count);
    const Place<T>* begin = nullptr;
    for (const Place<T>& place : places) {
      const std::int64_t i = first + (&place - places.data());
      blocks.rows[as_size(i)] = place.row;
      if (begin != nullptr && &place - begin < PointBlocks::size && is_near(place, *begin, 0.5 * longest)) continue;
      is_first[as_size(i)] = 1;
      begin = &place;
    }
  });
  for (std::size_t i = 0; i < is_first.size(); ++i) {
    if (is_first[i] != 0) blocks.starts.push_back(static_cast<std::int32_t>(i));
  }
  blocks.starts.push_back(static_cast<std::int32_t>(is_first.size()));
  return blocks;
}

template <class T>
PointBlocks::PointBlocks(const Rows<T>& points, BlockRows blocks, const Scaling& scaling, int num_threads)
    : rows_(std::move(blocks.rows)), starts_(std::move(blocks.starts)) {
  for (std::vector<float>& axis : axes_) axis.resize(as_size(num_readable()));
  origins_.resize(as_size(3 * num_blocks()));
  halves_.resize(as_size(3 * num_blocks()));
  std::int64_t num_nodes = num_blocks();
  while (num_nodes > 0 && (levels_.empty() || num_nodes > 1)) {
    num_nodes = (num_nodes + size - 1) / size;
    levels_.emplace_back(as_size(num_nodes * simd::node_floats));
  }

  parallel_for(num_blocks(), size * nodes_per_task, num_threads, [&](std::int64_t block) {
    const std::int64_t count = end(block) - begin(block);
    assert(count > 0);
    double places[3][size];
    for (std::int64_t i = 0; i < count; ++i) {
      const T* const point = points[row(begin(block) + i)];
      for (int axis = 0; axis < 3; ++axis) {
        places[axis][i] = (static_cast<double>(point[axis]) - scaling.center[axis]) * scaling.scale;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double* const place = places[axis];
      const double origin = 0.5 * (*std::min_element(place, place + count) + *std::max_element(place, place + count));
      origins_[as_size(3 * block + axis)] = origin;
      float* const to = axes_[axis].data() + begin(block);
      for (std::int64_t i = 0; i < count; ++i) to[i] = static_cast<float>(place[i] - origin);
    }
  });
  refit(num_threads);
}

double PointBlocks::reach() const {
  float reach = 0.0F;
  if (levels_.empty()) return 0.0;
  for (const float end : levels_.back()) {
    if (std::abs(end) < infinity<float>) reach = std::max(reach, std::abs(end));  // no box has infinity
  }
  return static_cast<double>(reach);
}

void PointBlocks::refit(int num_threads) {
  if (levels_.empty()) return;
  const std::int64_t num_nodes = (num_blocks() + size - 1) / size;
  parallel_for(num_nodes, nodes_per_task, num_threads, [&](std::int64_t node) { fit_node(node); });
  fit_upper_levels();
}

// The boxes of the blocks under a node; no box where there is no block.
void PointBlocks::fit_node(std::int64_t node) {
  const std::int64_t first = node * size, last = std::min(first + size, num_blocks());
  std::int32_t starts[size + 1];
  for (std::int64_t i = 0; i <= size; ++i) {
    starts[i] = static_cast<std::int32_t>(first + i <= last ? begin(first + i) : begin(last - 1));
  }
  const float* const axes[3] = {axes_[0].data(), axes_[1].data(), axes_[2].data()};
  simd::BlockFit fit;
  simd::fit_blocks()(axes, starts, fit);

  float* const boxes = levels_[0].data() + node * simd::node_floats;
  std::fill(boxes, boxes + 3 * size, infinity<float>);
  std::fill(boxes + 3 * size, boxes + 6 * size, -infinity<float>);
  for (std::int64_t block = first; block < last; ++block) {
    const std::int64_t i = block - first;
    for (int axis = 0; axis < 3; ++axis) {
      const double origin = origins_[as_size(3 * block + axis)];
      const float lower = fit.lower[axis][i], upper = fit.upper[axis][i];
      boxes[axis * size + i] = round_down(origin + static_cast<double>(lower));
      boxes[(3 + axis) * size + i] = round_up(origin + static_cast<double>(upper));
      halves_[as_size(3 * block + axis)] = std::max(std::abs(lower), std::abs(upper));
    }
  }
}

void PointBlocks::fit_upper_levels() {
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    const std::vector<float>& below = levels_[level - 1];
    const std::int64_t num_children = static_cast<std::int64_t>(below.size()) / simd::node_floats;
    for (std::int64_t child = 0; child < static_cast<std::int64_t>(levels_[level].size()) / 6; ++child) {
      float* const to = levels_[level].data() + child / size * simd::node_floats + child % size;
      const float* const from = below.data() + child * simd::node_floats;
      for (int axis = 0; axis < 3; ++axis) {
        const float* const lower = from + axis * size;
        const float* const upper = lower + 3 * size;
        const bool exists = child < num_children;
        to[axis * size] = exists ? *std::min_element(lower, lower + size) : infinity<float>;
        to[(3 + axis) * size] = exists ? *std::max_element(upper, upper + size) : -infinity<float>;
      }
    }
  }
}

simd::PairPoints PointBlocks::view(const float* mass) const {
  simd::PairPoints view{};
  view.x = axes_[0].data();
  view.y = axes_[1].data();
  view.z = axes_[2].data();
  view.mass = mass;
  view.starts = starts_.data();
  view.origin = origins_.data();
  view.halves = halves_.data();
  view.tree.num_levels = static_cast<int>(levels_.size());
  for (std::size_t level = 0; level < levels_.size(); ++level) view.tree.nodes[level] = levels_[level].data();
  return view;
}

simd::PairTargets PointBlocks::block(std::int64_t block) const {
  simd::PairTargets targets{};
  targets.count = static_cast<int>(end(block) - begin(block));
  targets.x = axes_[0].data() + begin(block);
  targets.y = axes_[1].data() + begin(block);
  targets.z = axes_[2].data() + begin(block);
  const float* const node = levels_[0].data() + block / size * simd::node_floats + block % size;
  for (int axis = 0; axis < 3; ++axis) {
    targets.origin[axis] = origins_[as_size(3 * block + axis)];
    targets.lower[axis] = node[axis * size];
    targets.upper[axis] = node[(3 + axis) * size];
  }
  return targets;
}

template BlockRows block_rows(const Rows<float>&, double, bool, int);
template BlockRows block_rows(const Rows<double>&, double, bool, int);
template PointBlocks::PointBlocks(const Rows<float>&, BlockRows, const Scaling&, int);
template PointBlocks::PointBlocks(const Rows<double>&, BlockRows, const Scaling&, int);

}  // namespace nacre
