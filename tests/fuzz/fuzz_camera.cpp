// Cameras of any numbers: rays, projections, depths.
#include "bytes.hpp"

NACRE_FUZZ_TARGET(bytes) {
  const nacre::Camera camera = bytes.camera();
  for (int i = 0; i < 8; ++i) {
    const int u = bytes.integer(0, camera.width() - 1), v = bytes.integer(0, camera.height() - 1);
    const nacre::Ray ray = camera.ray(u, v);
    const bool is_finite = std::isfinite(ray.direction_x) && std::isfinite(ray.direction_y);
    NACRE_HOLDS(is_finite || (std::isnan(ray.direction_x) && std::isnan(ray.direction_y)));
    const Eigen::Vector3d point(bytes.number(), bytes.number(), bytes.number());
    const Eigen::Vector2d pixel = camera.project(point);
    const bool behind = camera.model() == nacre::Camera::Model::pinhole && !(point.z() > 0.0);
    NACRE_HOLDS(!behind || std::isnan(pixel.x()));
    (void)camera.depth_of(point);
  }
  NACRE_HOLDS(camera == nacre::Camera(camera));
}
