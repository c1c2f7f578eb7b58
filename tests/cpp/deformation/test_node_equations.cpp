// The sparse solver against a dense one.
#include <Eigen/Cholesky>
#include <cmath>

#include "base/random.hpp"
#include "deformation/node_equations.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

// A chain of nodes, each pulled towards the next: with a matrix that is positive definite.
NodeEquations chain(int num_nodes, Eigen::MatrixXd& dense, Eigen::VectorXd& right_side) {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (int i = 0; i + 1 < num_nodes; ++i) pairs.emplace_back(i + 1, i);
  NodeEquations equations(static_cast<std::size_t>(num_nodes), pairs);
  dense = Eigen::MatrixXd::Zero(6 * num_nodes, 6 * num_nodes);
  right_side = Eigen::VectorXd::Zero(6 * num_nodes);
  const auto add = [&](int i, int j, const Matrix6& block) {
    equations.block(equations.block_at(i, j)) += block;
    dense.block<6, 6>(6 * i, 6 * j) += block;
  };
  for (int i = 0; i < num_nodes; ++i) {
    for (int k = 0; k < 6; ++k) {
      const double value = random_normal(1, static_cast<std::uint64_t>(6 * i + k));
      equations.right_side(static_cast<std::size_t>(i))[k] = right_side[6 * i + k] = value;
    }
    add(i, i, 0.01 * Matrix6::Identity());
    if (i + 1 == num_nodes) break;
    Matrix6 root;
    for (int k = 0; k < 36; ++k) root.data()[k] = random_normal(2, static_cast<std::uint64_t>(36 * i + k));
    const Matrix6 pull = root.transpose() * root + Matrix6::Identity();
    add(i, i, pull);
    add(i + 1, i + 1, pull);
    add(i, i + 1, -pull);
    add(i + 1, i, -pull);
  }
  return equations;
}

}  // namespace

TEST_CASE("conjugate gradients find what a dense Cholesky decomposition finds") {
  Eigen::MatrixXd dense;
  Eigen::VectorXd right_side;
  const NodeEquations equations = chain(12, dense, right_side);
  const Eigen::VectorXd expected = dense.llt().solve(right_side);
  const std::vector<Vector6> found = equations.solve(1e-12, 1000, 1);
  for (int i = 0; i < 12; ++i) {
    CHECK((found[static_cast<std::size_t>(i)] - expected.segment<6>(6 * i)).norm() < 1e-6 * expected.norm());
  }
}

TEST_CASE("any number of threads solves to the same bits") {
  Eigen::MatrixXd dense;
  Eigen::VectorXd right_side;
  const NodeEquations equations = chain(200, dense, right_side);
  const std::vector<Vector6> one = equations.solve(1e-3, 60, 1);
  for (const int num_threads : {2, 3, 8}) CHECK(equations.solve(1e-3, 60, num_threads) == one);
}

TEST_CASE("equations without a right side move nothing") {
  Eigen::MatrixXd dense;
  Eigen::VectorXd right_side;
  NodeEquations equations = chain(3, dense, right_side);
  for (std::size_t i = 0; i < 3; ++i) equations.right_side(i).setZero();
  for (const Vector6& motion : equations.solve(1e-3, 60, 1)) CHECK(motion == Vector6::Zero());
}
