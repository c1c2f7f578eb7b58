#include "registration/weak_directions.hpp"

#include <Eigen/Eigenvalues>

namespace nacre {

Directions split_directions(const Eigen::MatrixXd& information, double least) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::Index num_weak = (eigen.eigenvalues().array() < least).count();
  return {eigen.eigenvectors().leftCols(num_weak), eigen.eigenvectors().rightCols(information.cols() - num_weak)};
}

Eigen::VectorXd solve_normal_equations(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient) {
  return hessian.ldlt().solve(gradient);
}

}  // namespace nacre
