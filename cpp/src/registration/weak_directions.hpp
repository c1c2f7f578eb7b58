// What information determines, and what it leaves open.
#pragma once

#include <Eigen/Core>

namespace nacre {

// Orthonormal directions, one a column.
struct Directions {
  Eigen::MatrixXd weak;  // with less than the least information
  Eigen::MatrixXd sure;
};

// Of a symmetric matrix: the more information, the more to the right.
Directions split_directions(const Eigen::MatrixXd& information, double least);

// The least squares solution of normal equations; the hessian is positive definite.
Eigen::VectorXd solve_normal_equations(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient);

}  // namespace nacre
