#include "registration/motion_basis.hpp"

#include "base/se3.hpp"
#include "registration/icp.hpp"

namespace nacre {

MotionBasis MotionBasis::all(const Eigen::Vector3d& center, double extent) {
  MotionBasis basis{Matrix6::Identity(), center};
  basis.twists.leftCols(3) /= extent;
  return basis;
}

MotionBasis MotionBasis::on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& center) {
  return {motions_on_plane(normal), center};
}

Pose MotionBasis::apply(const Amounts& amounts) const { return motion_about(center, twists * amounts); }

}  // namespace nacre
