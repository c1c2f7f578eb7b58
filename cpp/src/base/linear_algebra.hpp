// Eigen's solvers, which take long to compile, compiled once. For problems that are small or rare: their memory is
// allocated.
#pragma once

#include "nacre/types.hpp"

namespace nacre {

// Of a symmetric matrix: values in ascending order, and orthonormal vectors, one a column.
struct Eigensystem {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Eigensystem eigensystem(const Eigen::MatrixXd& symmetric);

// Solutions of symmetric, positive semidefinite equations.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right_side);
// The same for several right sides, one a column.
Eigen::MatrixXd solve_symmetric_columns(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right_sides);
// The solution among the combinations of directions, one a column.
Eigen::VectorXd solve_symmetric_along(const Eigen::MatrixXd& directions,
                                      const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                      const Eigen::Ref<const Eigen::VectorXd>& right_side);

}  // namespace nacre
