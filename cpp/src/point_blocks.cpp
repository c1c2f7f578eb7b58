#include "point_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.hpp"

namespace nacre {
namespace {

constexpr float far_away = 1e18F;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t nodes_per_task = 16;

std::size_t as_size(std::int64_t i) { return static_cast<std::size_t>(i); }

// The nearest float that is not greater, or not smaller, within a unit in the last place.
float round_down(double x) { return static_cast<float>(x - std::abs(x) * 1.2e-7); }
float round_up(double x) { return static_cast<float>(x + std::abs(x) * 1.2e-7); }

}  // namespace

template <class Cloud>
PointBlocks::PointBlocks(const Cloud& points, const SpatialOrder& order, const Scaling& scaling, int num_threads) {
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

  counts_.resize(as_size(count));
  rows_.resize(as_size(count * size));
  for (std::vector<float>& axis : axes_) axis.resize(as_size(count * size));
  origins_.resize(as_size(3 * count));
  radii_.resize(as_size(count));
  std::int64_t num_nodes = count;
  while (num_nodes > 0 && (levels_.empty() || num_nodes > 1)) {
    num_nodes = (num_nodes + size - 1) / size;
    levels_.emplace_back(as_size(num_nodes * simd::node_floats));
  }

  parallel_for(count, size * nodes_per_task, num_threads, [&](std::int64_t block) {
    const std::uint32_t first = starts[as_size(block)], last = starts[as_size(block) + 1];
    const std::size_t at = as_size(block * size);
    counts_[as_size(block)] = static_cast<std::uint8_t>(last - first);
    Eigen::Vector3d places[size];
    Eigen::AlignedBox3d box;
    for (std::uint32_t i = first; i < last; ++i) {
      const std::uint32_t row = order.rows[i];
      Eigen::Vector3d& place = places[i - first];
      place = (points.row(row).template cast<double>().transpose() - scaling.center) * scaling.scale;
      box.extend(place);
      rows_[at + i - first] = row;
    }
    const Eigen::Vector3d origin = box.center();
    for (int axis = 0; axis < 3; ++axis) {
      origins_[as_size(3 * block + axis)] = origin[axis];
      float* const to = axes_[axis].data() + at;
      std::fill(to, to + size, far_away);
      for (std::uint32_t i = 0; i < last - first; ++i) to[i] = static_cast<float>(places[i][axis] - origin[axis]);
    }
  });
  refit(num_threads);
}

void PointBlocks::refit(int num_threads) {
  if (levels_.empty()) return;
  const std::int64_t num_nodes = static_cast<std::int64_t>(levels_[0].size()) / simd::node_floats;
  parallel_for(num_nodes * size, size * nodes_per_task, num_threads, [&](std::int64_t block) { fit_block(block); });
  fit_upper_levels();
}

// The block's box and radius; no box where there is no block.
void PointBlocks::fit_block(std::int64_t block) {
  float* const node = levels_[0].data() + block / size * simd::node_floats + block % size;
  const bool exists = block < num_blocks();
  float squared_distances[size] = {};
  for (int axis = 0; axis < 3; ++axis) {
    float& lower = node[axis * size];
    float& upper = node[(3 + axis) * size];
    lower = infinity;
    upper = -infinity;
    if (!exists) continue;
    const float* const from = axes_[axis].data() + block * size;
    for (int i = 0; i < count(block); ++i) {
      lower = std::min(lower, from[i]);
      upper = std::max(upper, from[i]);
      squared_distances[i] += from[i] * from[i];
    }
    lower = round_down(origins_[as_size(3 * block + axis)] + lower);
    upper = round_up(origins_[as_size(3 * block + axis)] + upper);
  }
  if (exists) {
    radii_[as_size(block)] = 1.000001F * std::sqrt(*std::max_element(squared_distances, squared_distances + size));
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
  view.radius = radii_.data();
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

template PointBlocks::PointBlocks(const PointsRef&, const SpatialOrder&, const Scaling&, int);
template PointBlocks::PointBlocks(const PointsDoubleRef&, const SpatialOrder&, const Scaling&, int);

}  // namespace nacre
