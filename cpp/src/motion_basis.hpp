// The motions that something may make: combinations of some twists about a centre.
#pragma once

#include "icp_step.hpp"

namespace nacre {

struct MotionBasis {
  using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;  // (rotation, translation), one a column
  using Amounts = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

  Twists twists;
  Eigen::Vector3d center;

  // Rotations by amounts of [m] at a distance of `extent` from the centre.
  static MotionBasis all(const Eigen::Vector3d& center, double extent) {
    MotionBasis basis{Matrix6::Identity(), center};
    basis.twists.leftCols(3) /= extent;
    return basis;
  }
  // Turns about the normal of a plane (unit length), and shifts across it.
  static MotionBasis on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& center) {
    MotionBasis basis{Twists::Zero(6, 3), center};
    const Eigen::Vector3d x = normal.unitOrthogonal();
    basis.twists.col(0).head<3>() = normal;
    basis.twists.col(1).tail<3>() = x;
    basis.twists.col(2).tail<3>() = normal.cross(x);
    return basis;
  }

  // How a residual changes with the amounts.
  Amounts row(const Pair& pair) const {
    Vector6 by_twist;
    by_twist << (pair.p - center).cross(pair.normal), pair.normal;
    return twists.transpose() * by_twist;
  }
  Pose apply(const Amounts& amounts) const {
    const Vector6 twist = twists * amounts;
    const double angle = twist.head<3>().norm();
    Pose motion = Pose::Identity();
    if (angle > 0.0) motion.linear() = Eigen::AngleAxisd(angle, twist.head<3>() / angle).toRotationMatrix();
    motion.translation() = center - motion.linear() * center + twist.tail<3>();
    return motion;
  }
};

}  // namespace nacre
