// How far away a place may be, and the check of poses that come from outside.
#pragma once

#include <string>

#include "base/check.hpp"
#include "nacre/types.hpp"

namespace nacre {

constexpr double farthest_place = 1e30;  // [m]: of a camera, and from it; what is moved is to stay within floats

inline bool is_rigid(const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  return pose.matrix().allFinite() && pose.translation().cwiseAbs().maxCoeff() < farthest_place &&
         (rotation * rotation.transpose()).isIdentity(1e-3) && rotation.determinant() > 0.0;
}

inline void require_rigid(const Pose& pose, const std::string& name) {
  require(is_rigid(pose), name, "a rotation and a finite translation in metres", pose.matrix());
}

}  // namespace nacre
