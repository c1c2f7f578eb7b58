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

}  // namespace nacre
