#include "registration/weak_directions.hpp"

#include "base/linear_algebra.hpp"

namespace nacre {

Directions split_directions(const Eigen::MatrixXd& information, double least) {
  const Eigensystem eigen = eigensystem(information);
  const Eigen::Index num_weak = (eigen.values.array() < least).count();
  return {eigen.vectors.leftCols(num_weak), eigen.vectors.rightCols(information.cols() - num_weak)};
}

}  // namespace nacre
