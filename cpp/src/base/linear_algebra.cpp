#include "base/linear_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace nacre {

Eigensystem eigensystem(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right_side) {
  return matrix.ldlt().solve(right_side);
}

Eigen::MatrixXd solve_symmetric_columns(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right_sides) {
  return matrix.ldlt().solve(right_sides);
}

Eigen::VectorXd solve_symmetric_along(const Eigen::MatrixXd& directions,
                                      const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                      const Eigen::Ref<const Eigen::VectorXd>& right_side) {
  return directions *
         solve_symmetric(directions.transpose() * matrix * directions, directions.transpose() * right_side);
}

}  // namespace nacre
