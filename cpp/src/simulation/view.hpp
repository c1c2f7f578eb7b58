// A mesh as the pixels of a camera see it.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "nacre/camera.hpp"
#include "nacre/mesh.hpp"

namespace nacre {

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

struct WorldRay {
  Eigen::Vector3d origin, direction;
};

// The first point on a ray.
struct Sight {
  double depth = 0.0;                                // in the camera's depth kind [m]
  double z = 0.0;                                    // along the optical axis [m]
  double cosine = 1.0;                               // between ray and normal, at least 0
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   // in the world
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // towards the camera
};

using Hits = std::vector<MeshTree::Hit>;
using Depths = std::vector<double>;  // of the pixels; NaN: not measured

class View {
 public:
  View(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera)
      : mesh_(mesh),
        camera_(camera),
        rotation_(world_from_camera.linear()),
        translation_(world_from_camera.translation()) {}

  std::int64_t num_pixels() const { return static_cast<std::int64_t>(width()) * height(); }
  int width() const { return camera_.width(); }
  int height() const { return camera_.height(); }
  double focal_length() const { return std::abs(camera_.fx()); }  // [pixels]
  double footprint(double depth) const { return std::abs(camera_.footprint(depth)); }
  double diagonal() const { return (mesh_.upper() - mesh_.lower()).norm(); }
  Eigen::Vector3d normal(std::int32_t triangle) const { return mesh_.normal(triangle); }
  MeshTree::Hit cast(const WorldRay& ray) const { return mesh_.cast(ray.origin, ray.direction); }

  WorldRay ray(std::int64_t pixel) const {
    const Ray ray = camera_ray(pixel);
    return to_world({ray.origin_x, ray.origin_y, 0.0}, {ray.direction_x, ray.direction_y, ray.direction_z});
  }

  // Between pixel centres, by linear interpolation of the rays; beyond the border, by extrapolation.
  WorldRay ray(double u, double v) const {
    const int left = std::clamp(static_cast<int>(std::floor(u)), 0, std::max(0, width() - 2));
    const int top = std::clamp(static_cast<int>(std::floor(v)), 0, std::max(0, height() - 2));
    const int right = std::min(left + 1, width() - 1), bottom = std::min(top + 1, height() - 1);
    const double x = u - left, y = v - top;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
    const auto add = [&](int column, int row, double weight) {
      const Ray ray = camera_.ray(column, row);
      origin += weight * Eigen::Vector3d(ray.origin_x, ray.origin_y, 0.0);
      direction += weight * Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
    };
    add(left, top, (1.0 - x) * (1.0 - y));
    add(right, top, x * (1.0 - y));
    add(left, bottom, (1.0 - x) * y);
    add(right, bottom, x * y);
    return to_world(origin, direction);
  }

  // What a ray sees first.
  std::optional<Sight> see(const WorldRay& ray) const {
    const MeshTree::Hit hit = cast(ray);
    if (hit.triangle < 0) return std::nullopt;
    Sight sight;
    sight.depth = hit.distance;
    sight.point = ray.origin + hit.distance * ray.direction;
    sight.z = rotation_.col(2).dot(sight.point - translation_);
    const Eigen::Vector3d normal = mesh_.normal(hit.triangle);
    const double toward = -normal.dot(ray.direction.normalized());
    sight.cosine = std::abs(toward);
    sight.normal = toward < 0.0 ? Eigen::Vector3d(-normal) : normal;
    return sight;
  }

  // Whether a point of the world is in the image, hidden or not.
  bool shows(const Eigen::Vector3d& point) const {
    const Eigen::Vector2d pixel = camera_.project(rotation_.transpose() * (point - translation_));
    return (pixel.array() > -0.5).all() && pixel.x() < width() - 0.5 && pixel.y() < height() - 0.5;
  }

  // A place beside the camera, to its right, in the world.
  Eigen::Vector3d beside(double shift) const { return translation_ + shift * rotation_.col(0); }

  // The depth value of a pixel that sees a point at z.
  double depth_of(std::int64_t pixel, double z) const { return z / camera_ray(pixel).direction_z; }

 private:
  Ray camera_ray(std::int64_t pixel) const {
    return camera_.ray(static_cast<int>(pixel % width()), static_cast<int>(pixel / width()));
  }
  WorldRay to_world(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return {rotation_ * origin + translation_, rotation_ * direction};
  }

  const MeshTree& mesh_;
  const Camera& camera_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
};

// The depth of each pixel: of(pixel, u, v).
template <class Of>
Depths depths_of(const View& view, int num_threads, Of&& of) {
  Depths depths(as_size(view.num_pixels()));
  parallel_for(view.num_pixels(), 256, num_threads, [&](std::int64_t i) {
    depths[as_size(i)] = of(i, static_cast<double>(i % view.width()), static_cast<double>(i / view.width()));
  });
  return depths;
}

inline Hits cast_pixels(const View& view, int num_threads) {
  Hits hits(as_size(view.num_pixels()));
  parallel_for(view.num_pixels(), 1024, num_threads,
               [&](std::int64_t i) { hits[as_size(i)] = view.cast(view.ray(i)); });
  return hits;
}

}  // namespace nacre
