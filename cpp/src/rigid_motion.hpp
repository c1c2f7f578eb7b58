// Rigid motions and their twists (rotation [rad], translation [m]), as in Sola, Deray and Atchuthan 2018.
#pragma once

#include <cmath>

#include "nacre/types.hpp"

namespace nacre {

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

inline Pose exp_twist(const Vector6& twist) {
  const Eigen::Vector3d rotation = twist.head<3>(), translation = twist.tail<3>();
  const double angle = rotation.norm();
  const Eigen::Matrix3d k = cross_matrix(rotation);
  const double a = angle > 1e-5 ? (1.0 - std::cos(angle)) / (angle * angle) : 0.5;
  const double b = angle > 1e-5 ? (angle - std::sin(angle)) / (angle * angle * angle) : 1.0 / 6.0;
  Pose pose = Pose::Identity();
  if (angle > 0.0) pose.linear() = Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
  pose.translation() = (Eigen::Matrix3d::Identity() + a * k + b * k * k) * translation;
  return pose;
}

// The inverse of exp_twist, for angles up to pi.
inline Vector6 log_motion(const Pose& pose) {
  const Eigen::AngleAxisd turn(pose.linear());
  const double angle = turn.angle();
  const Eigen::Vector3d rotation = angle * turn.axis();
  const Eigen::Matrix3d k = cross_matrix(rotation);
  const double half = 0.5 * angle;
  const double a = angle > 1e-4 ? (1.0 - half * std::cos(half) / std::sin(half)) / (angle * angle) : 1.0 / 12.0;
  Vector6 twist;
  twist.head<3>() = rotation;
  twist.tail<3>() = (Eigen::Matrix3d::Identity() - 0.5 * k + a * k * k) * pose.translation();
  return twist;
}

// pose * exp_twist(t) = exp_twist(adjoint(pose) * t) * pose
inline Matrix6 adjoint(const Pose& pose) {
  Matrix6 matrix = Matrix6::Zero();
  matrix.topLeftCorner<3, 3>() = matrix.bottomRightCorner<3, 3>() = pose.linear();
  matrix.bottomLeftCorner<3, 3>() = cross_matrix(pose.translation()) * pose.linear();
  return matrix;
}

// Rotations that rounding has worn become rotations again.
inline Pose orthonormal(Pose pose) {
  pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return pose;
}

}  // namespace nacre
