// The motions that something may make: combinations of some twists about a centre.
#pragma once

#include "registration/icp_step.hpp"

namespace nacre {

struct MotionBasis {
  using Amounts = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

  TwistBasis twists;  // rotations in radians
  Eigen::Vector3d center;

  // Rotations by amounts of [m] at a distance of `extent` from the centre.
  static MotionBasis all(const Eigen::Vector3d& center, double extent);
  // Turns about the normal of a plane (unit length), and shifts across it.
  static MotionBasis on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& center);

  Pose apply(const Amounts& amounts) const;
};

}  // namespace nacre
