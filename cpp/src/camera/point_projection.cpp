#include "camera/point_projection.hpp"

#include <limits>

namespace nacre {

PointProjection::PointProjection(const Camera& camera, const Pose& world_from_camera) : camera_(camera) {
  const Pose camera_from_world = world_from_camera.inverse();
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(view_.rotation) = camera_from_world.linear().cast<float>();
  Eigen::Map<Eigen::Vector3f>(view_.translation) = camera_from_world.translation().cast<float>();
  view_.fx = static_cast<float>(camera.fx());
  view_.fy = static_cast<float>(camera.fy());
  view_.cx = static_cast<float>(camera.cx());
  view_.cy = static_cast<float>(camera.cy());
  view_.orthographic = camera.model() == Camera::Model::orthographic;
}

void PointProjection::project(const float* points, const float* normals, int count, Block& b) const {
  simd::project_points()(view_, points, normals, count,
                         {b.x, b.y, b.z, b.normal_x, b.normal_y, b.normal_z, b.u, b.v, b.facing});
  const bool is_distorted = camera_.distortion() != Camera::Distortion{};
  for (int i = 0; i < count && !view_.orthographic; ++i) {
    if (is_distorted) {
      const Eigen::Vector2f pixel = camera_.project(b.point(i).cast<double>()).cast<float>();
      b.u[i] = pixel.x();
      b.v[i] = pixel.y();
    } else if (!(b.z[i] > 0.0F)) {
      b.u[i] = b.v[i] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  simd::nearest_pixels()(b.u, b.v, count, camera_.width(), camera_.height(), b.pixel, b.inside);
}

}  // namespace nacre
