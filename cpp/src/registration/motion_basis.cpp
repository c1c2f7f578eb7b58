#include "registration/motion_basis.hpp"

#include "base/se3.hpp"

namespace nacre {

MotionBasis MotionBasis::all(const Eigen::Vector3d& center, double extent) {
  MotionBasis basis{Matrix6::Identity(), center};
  basis.twists.leftCols(3) /= extent;
  return basis;
}

MotionBasis MotionBasis::on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& center) {
  MotionBasis basis{Twists::Zero(6, 3), center};
  const Eigen::Vector3d x = normal.unitOrthogonal();
  basis.twists.col(0).head<3>() = normal;
  basis.twists.col(1).tail<3>() = x;
  basis.twists.col(2).tail<3>() = normal.cross(x);
  return basis;
}

MotionBasis::Amounts MotionBasis::row(const Pair& pair) const {
  Vector6 by_twist;
  by_twist << (pair.p - center).cross(pair.normal), pair.normal;
  return twists.transpose() * by_twist;
}

Pose MotionBasis::apply(const Amounts& amounts) const { return motion_about(center, twists * amounts); }

}  // namespace nacre
