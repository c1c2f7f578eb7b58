#include "camera/view_volume.hpp"

#include <cmath>

#include "camera/limits.hpp"

namespace nacre {

Box moved(const Box& box, const Pose& motion) {
  if (box.isEmpty()) return box;
  const Eigen::Isometry3f by(motion.cast<float>());
  const Eigen::Vector3f center = by * box.center();
  const Eigen::Vector3f half = 0.5F * (by.linear().cwiseAbs() * box.sizes());
  return {center - half, center + half};
}

ViewVolume::ViewVolume(const Camera& camera, const Pose& world_from_camera, double margin, double slack,
                       double farthest)
    : slack_(slack) {
  // Each keeps a . p + b >= 0 of points p of the camera frame.
  const auto add = [&](const Eigen::Vector3d& a, double b) {
    const double length = a.norm();
    const Eigen::Vector3d inward = world_from_camera.linear() * (a / length);
    planes_[num_planes_++] = {inward, b / length - inward.dot(world_from_camera.translation())};
  };
  const bool is_orthographic = camera.model() == Camera::Model::orthographic;
  if (!is_orthographic) add(Eigen::Vector3d::UnitZ(), 0.0);
  if (std::isfinite(farthest)) add(-Eigen::Vector3d::UnitZ(), farthest);
  if (camera.distortion() != Camera::Distortion{}) return;
  const auto add_sides = [&](int axis, double focal_length, double centre, int size) {
    const double beyond = margin * size + 1.0;  // a pixel: of rounding
    for (const bool is_far_side : {false, true}) {
      const double edge = is_far_side ? size - 1.0 + beyond : -beyond;
      const double side = is_far_side ? -1.0 : 1.0;
      Eigen::Vector3d a = Eigen::Vector3d::Zero();
      a[axis] = side * focal_length;
      if (is_orthographic) {
        add(a, side * (centre - edge));
      } else {
        a.z() = side * (centre - edge);
        add(a, 0.0);
      }
    }
  };
  add_sides(0, camera.fx(), camera.cx(), camera.width());
  add_sides(1, camera.fy(), camera.cy(), camera.height());
}

bool ViewVolume::may_hold(const Box& box) const {
  if (box.isEmpty()) return false;
  const Eigen::Vector3d center = box.center().cast<double>(), half = 0.5 * box.sizes().cast<double>();
  const double rounding = camera_limits::projection_rounding * (center.cwiseAbs() + half).sum();
  for (std::size_t i = 0; i < num_planes_; ++i) {
    const Plane& plane = planes_[i];
    const double reach = plane.inward.cwiseAbs().dot(half) + slack_ + rounding +
                         camera_limits::projection_rounding * std::abs(plane.offset);
    if (plane.inward.dot(center) + plane.offset < -reach) return false;
  }
  return true;
}

}  // namespace nacre
