#include "deformation/node_equations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"

namespace nacre {
namespace {

constexpr std::int64_t nodes_per_task = 32;

double dot(const std::vector<Vector6>& a, const std::vector<Vector6>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

}  // namespace

NodeEquations::NodeEquations(std::size_t num_nodes, std::vector<std::pair<std::int32_t, std::int32_t>> pairs)
    : starts_(num_nodes + 1, 0), right_side_(num_nodes, Vector6::Zero()) {
  const std::size_t num_pairs = pairs.size();
  for (std::size_t i = 0; i < num_pairs; ++i) pairs.emplace_back(pairs[i].second, pairs[i].first);
  for (std::size_t node = 0; node < num_nodes; ++node) {
    pairs.emplace_back(static_cast<std::int32_t>(node), static_cast<std::int32_t>(node));
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  columns_.reserve(pairs.size());
  for (const auto& [row, column] : pairs) {
    ++starts_[static_cast<std::size_t>(row) + 1];
    columns_.push_back(column);
  }
  for (std::size_t row = 0; row < num_nodes; ++row) starts_[row + 1] += starts_[row];
  blocks_.assign(columns_.size(), Matrix6::Zero());
}

void NodeEquations::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Matrix6::Zero());
  set_right_side_zero();
}

void NodeEquations::set_right_side_zero() { std::fill(right_side_.begin(), right_side_.end(), Vector6::Zero()); }

std::size_t NodeEquations::block_at(std::int32_t row, std::int32_t column) const {
  const auto begin = columns_.begin() + static_cast<std::ptrdiff_t>(starts_[static_cast<std::size_t>(row)]);
  const auto end = columns_.begin() + static_cast<std::ptrdiff_t>(starts_[static_cast<std::size_t>(row) + 1]);
  return static_cast<std::size_t>(std::lower_bound(begin, end, column) - columns_.begin());
}

void NodeEquations::multiply(const Vectors& x, Vectors& result, int num_threads) const {
  parallel_for(static_cast<std::int64_t>(num_nodes()), nodes_per_task, num_threads, [&](std::int64_t number) {
    const auto row = static_cast<std::size_t>(number);
    Vector6 sum = Vector6::Zero();
    for (std::size_t k = starts_[row]; k < starts_[row + 1]; ++k) {
      sum.noalias() += blocks_[k] * x[static_cast<std::size_t>(columns_[k])];
    }
    result[row] = sum;
  });
}

std::vector<Vector6> NodeEquations::solve(double tolerance, int most_steps, int num_threads) const {
  const std::size_t count = num_nodes();
  std::vector<Eigen::LLT<Matrix6>> diagonal;
  diagonal.reserve(count);
  for (std::size_t row = 0; row < count; ++row) {
    const auto node = static_cast<std::int32_t>(row);
    diagonal.emplace_back(blocks_[block_at(node, node)]);
  }
  const auto precondition = [&](const Vectors& residual, Vectors& result) {
    for (std::size_t i = 0; i < count; ++i) result[i] = diagonal[i].solve(residual[i]);
  };
  Vectors x(count, Vector6::Zero()), residual = right_side_, scaled(count), direction, product(count);
  const double smallest = tolerance * tolerance * dot(residual, residual);
  precondition(residual, scaled);
  direction = scaled;
  double size = dot(residual, scaled);
  for (int step = 0; step < most_steps && dot(residual, residual) > smallest; ++step) {
    multiply(direction, product, num_threads);
    const double curvature = dot(direction, product);
    if (!(curvature > 0.0)) break;
    const double length = size / curvature;
    for (std::size_t i = 0; i < count; ++i) {
      x[i] += length * direction[i];
      residual[i] -= length * product[i];
    }
    precondition(residual, scaled);
    const double next = dot(residual, scaled);
    for (std::size_t i = 0; i < count; ++i) direction[i] = scaled[i] + next / size * direction[i];
    size = next;
  }
  return x;
}

}  // namespace nacre
