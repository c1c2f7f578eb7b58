#include "base/se3.hpp"

#include <cmath>

namespace nacre {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

Eigen::Matrix3d rotation(const Eigen::Vector3d& axis, double angle) {
  const double length = axis.norm();
  if (!(length > 0.0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, axis / length).toRotationMatrix();
}

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

Pose motion_about(const Eigen::Vector3d& center, const Vector6& rotation_and_translation) {
  const Eigen::Vector3d turn = rotation_and_translation.head<3>(), translation = rotation_and_translation.tail<3>();
  Pose motion = Pose::Identity();
  motion.linear() = rotation(turn, turn.norm());
  motion.translation() = center - motion.linear() * center + translation;
  return motion;
}

Pose exp_twist(const Vector6& twist) {
  const Eigen::Vector3d turn = twist.head<3>(), translation = twist.tail<3>();
  const double angle = turn.norm();
  const Eigen::Matrix3d k = cross_matrix(turn);
  const double a = angle > 1e-5 ? (1.0 - std::cos(angle)) / (angle * angle) : 0.5;
  const double b = angle > 1e-5 ? (angle - std::sin(angle)) / (angle * angle * angle) : 1.0 / 6.0;
  Pose pose = Pose::Identity();
  pose.linear() = rotation(turn, angle);
  pose.translation() = (Eigen::Matrix3d::Identity() + a * k + b * k * k) * translation;
  return pose;
}

Vector6 log_motion(const Pose& pose) {
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

Matrix6 adjoint(const Pose& pose) {
  Matrix6 matrix = Matrix6::Zero();
  matrix.topLeftCorner<3, 3>() = matrix.bottomRightCorner<3, 3>() = pose.linear();
  matrix.bottomLeftCorner<3, 3>() = cross_matrix(pose.translation()) * pose.linear();
  return matrix;
}

Pose blend(const Pose& a, const Pose& b, double part, const Eigen::Vector3d& pivot) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(a.linear()).slerp(part, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  pose.translation() = (1.0 - part) * (a * pivot) + part * (b * pivot) - pose.linear() * pivot;
  return pose;
}

Pose orthonormal(const Pose& pose) {
  Pose result = pose;
  result.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return result;
}

}  // namespace nacre
