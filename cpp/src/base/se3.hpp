// Rigid motions and their twists (rotation [rad], translation [m]), as in Sola, Deray and Atchuthan 2018.
#pragma once

#include "nacre/types.hpp"

namespace nacre {

// cross_matrix(v) * w = v x w
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

// Rodrigues' formula; the axis may have any length, and none means no rotation.
Eigen::Matrix3d rotation(const Eigen::Vector3d& axis, double angle);

// The turn from one pose to the other [rad].
double angle_between(const Pose& a, const Pose& b);

// A rotation about a centre, then a translation.
Pose motion_about(const Eigen::Vector3d& center, const Vector6& rotation_and_translation);

Pose exp_twist(const Vector6& twist);

// The inverse of exp_twist, for angles up to pi.
Vector6 log_motion(const Pose& pose);

// pose * exp_twist(t) = exp_twist(adjoint(pose) * t) * pose
Matrix6 adjoint(const Pose& pose);

// Between two motions; the pivot goes along a straight line.
Pose blend(const Pose& a, const Pose& b, double part, const Eigen::Vector3d& pivot);

// Rotations that rounding has worn become rotations again.
Pose orthonormal(const Pose& pose);

}  // namespace nacre
