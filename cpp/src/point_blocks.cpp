#include "point_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.hpp"
#include "simd/block_fit.hpp"

namespace nacre {
namespace {

constexpr float far_away = 1e18F;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t nodes_per_task = 4;

std::size_t as_size(std::int64_t i) { return static_cast<std::size_t>(i); }

// The nearest float that is not greater, or not smaller, within a unit in the last place.
float round_down(double x) { return static_cast<float>(x - std::abs(x) * 1.2e-7); }
float round_up(double x) { return static_cast<float>(x + std::abs(x) * 1.2e-7); }

}  // namespace

template <class Cloud>
PointBlocks::PointBlocks(const Cloud& points, const CellOrder& order, const Scaling& scaling, int num_threads) {
  std::vector<std::uint32_t> starts;  // of the blocks, in the order
  const std::size_t num_points = order.rows.size();
  starts.reserve(num_points / size + num_points / 64 + 2);
  for (std::size_t i = 0; i < num_points;) {
    starts.push_back(static_cast<std::uint32_t>(i));
    const std::size_t most = std::min(num_points, i + static_cast<std::size_t>(size));
    const std::uint32_t cube = order.cubes[i];
    for (++i; i < most && order.cubes[i] == cube;) ++i;
  }
  const auto count = static_cast<std::int64_t>(starts.size());
  starts.push_back(static_cast<std::uint32_t>(num_points));

  std::int64_t num_nodes = count;
  while (num_nodes > 0 && (levels_.empty() || num_nodes > 1)) {
    num_nodes = (num_nodes + size - 1) / size;
    levels_.emplace_back(as_size(num_nodes * simd::node_floats));
  }
  const std::int64_t room = levels_.empty() ? 0 : static_cast<std::int64_t>(levels_[0].size()) / 6;  // for full nodes
  counts_.resize(as_size(count));
  rows_.resize(as_size(count * size));
  for (std::vector<float>& axis : axes_) axis.resize(as_size(room * size));
  origins_.resize(as_size(3 * room));
  halves_.resize(as_size(3 * room));

  using Scalar = typename Cloud::Scalar;
  const Scalar* const data = points.data();
  const std::int64_t stride = points.outerStride();
  parallel_for(count, size * nodes_per_task, num_threads, [&](std::int64_t block) {
    const std::uint32_t first = starts[as_size(block)], last = starts[as_size(block) + 1];
    counts_[as_size(block)] = static_cast<std::uint8_t>(last - first);
    double places[3][size];
    for (std::int64_t i = 0; i < size; ++i) {  // places that are left over repeat the last point for now
      const std::uint32_t row = order.rows[std::min<std::size_t>(first + as_size(i), last - 1)];
      rows_[as_size(block * size + i)] = row;
      const Scalar* const point = data + row * stride;
      for (int axis = 0; axis < 3; ++axis) places[axis][i] = static_cast<double>(point[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      double* const place = places[axis];
      for (int i = 0; i < size; ++i) place[i] = (place[i] - scaling.center[axis]) * scaling.scale;
      const double origin = 0.5 * (*std::min_element(place, place + size) + *std::max_element(place, place + size));
      origins_[as_size(3 * block + axis)] = origin;
      float* const to = axes_[axis].data() + block * size;
      for (int i = 0; i < size; ++i) to[i] = static_cast<float>(place[i] - origin);
      std::fill(to + (last - first), to + size, far_away);
    }
  });
  refit(num_threads);
}

void PointBlocks::refit(int num_threads) {
  if (levels_.empty()) return;
  const std::int64_t num_nodes = static_cast<std::int64_t>(levels_[0].size()) / simd::node_floats;
  parallel_for(num_nodes, nodes_per_task, num_threads, [&](std::int64_t node) { fit_node(node); });
  fit_upper_levels();
}

// The boxes of the blocks under a node; no box where there is no block.
void PointBlocks::fit_node(std::int64_t node) {
  const float* places[3];
  for (int axis = 0; axis < 3; ++axis) places[axis] = axes_[axis].data() + node * size * size;
  simd::BlockFit fit;
  simd::fit_blocks()(places, fit);
  float* const boxes = levels_[0].data() + node * simd::node_floats;
  for (std::int64_t i = 0; i < size; ++i) {
    const std::int64_t block = node * size + i;
    const bool exists = block < num_blocks();
    for (int axis = 0; axis < 3; ++axis) {
      const double origin = origins_[as_size(3 * block + axis)];
      boxes[axis * size + i] = exists ? round_down(origin + static_cast<double>(fit.lower[axis][i])) : infinity;
      halves_[as_size(3 * block + axis)] = std::max(std::abs(fit.lower[axis][i]), std::abs(fit.upper[axis][i]));
      boxes[(3 + axis) * size + i] = exists ? round_up(origin + static_cast<double>(fit.upper[axis][i])) : -infinity;
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
        to[axis * size] = exists ? *std::min_element(lower, lower + size) : infinity;
        to[(3 + axis) * size] = exists ? *std::max_element(upper, upper + size) : -infinity;
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
  view.origin = origins_.data();
  view.halves = halves_.data();
  view.tree.num_levels = static_cast<int>(levels_.size());
  for (std::size_t level = 0; level < levels_.size(); ++level) view.tree.nodes[level] = levels_[level].data();
  return view;
}

simd::PairTargets PointBlocks::block(std::int64_t block) const {
  simd::PairTargets targets{};
  targets.count = count(block);
  targets.x = axes_[0].data() + block * size;
  targets.y = axes_[1].data() + block * size;
  targets.z = axes_[2].data() + block * size;
  const float* const node = levels_[0].data() + block / size * simd::node_floats + block % size;
  for (int axis = 0; axis < 3; ++axis) {
    targets.origin[axis] = origins_[as_size(3 * block + axis)];
    targets.lower[axis] = node[axis * size];
    targets.upper[axis] = node[(3 + axis) * size];
  }
  return targets;
}

template PointBlocks::PointBlocks(const PointsRef&, const CellOrder&, const Scaling&, int);
template PointBlocks::PointBlocks(const PointsDoubleRef&, const CellOrder&, const Scaling&, int);

}  // namespace nacre
