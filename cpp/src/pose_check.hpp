// The check of poses that come from the caller.
#pragma once

#include <string>

#include "check.hpp"
#include "nacre/types.hpp"

namespace nacre {

// Throws std::invalid_argument; what is moved is to stay within floats.
inline void require_rigid(const Pose& pose, const std::string& name) {
  const Eigen::Matrix3d rotation = pose.linear();
  const bool is_rigid = pose.matrix().allFinite() && pose.translation().cwiseAbs().maxCoeff() < 1e30 &&
                        (rotation * rotation.transpose()).isIdentity(1e-3) && rotation.determinant() > 0.0;
  require(is_rigid, name, "a rotation and a finite translation in metres", pose.matrix());
}

}  // namespace nacre
