// The equations of how nodes move: a sparse symmetric matrix of 6 x 6 blocks, solved by conjugate gradients.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

// Unknowns of each node: its rotation about itself, its translation.
class NodeEquations {
 public:
  // pairs: of nodes that have to do with each other, in any order, repeated or not.
  NodeEquations(std::size_t num_nodes, std::vector<std::pair<std::int32_t, std::int32_t>> pairs);

  std::size_t num_nodes() const { return starts_.size() - 1; }
  void set_zero();
  void set_right_side_zero();
  // Where the block of two nodes is; they are a pair, or the same.
  std::size_t block_at(std::int32_t row, std::int32_t column) const;
  Matrix6& block(std::size_t place) { return blocks_[place]; }
  Vector6& right_side(std::size_t node) { return right_side_[node]; }

  // Conjugate gradients, preconditioned by the blocks of the diagonal (Saad 2003, algorithm 9.1), until the residual is
  // so small a part of the right side.
  std::vector<Vector6> solve(double tolerance, int most_steps, int num_threads) const;

 private:
  using Vectors = std::vector<Vector6>;
  void multiply(const Vectors& x, Vectors& result, int num_threads) const;

  std::vector<std::size_t> starts_;  // of each row's blocks
  std::vector<std::int32_t> columns_;
  std::vector<Matrix6> blocks_;
  Vectors right_side_;
};

}  // namespace nacre
