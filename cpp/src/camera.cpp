#include "nacre/camera.hpp"

#include <cmath>
#include <limits>

#include "check.hpp"

namespace nacre {
namespace {

void check_size(int width, int height) {
  require(width > 0 && width <= 1 << 16, "width", "1 to 65536 pixels", width);
  require(height > 0 && height <= 1 << 16, "height", "1 to 65536 pixels", height);
}

// Normalised coordinates (x / z, y / z) of an undistorted ray to those of the distorted image, Brown-Conrady.
Eigen::Vector2d distort(const Eigen::Vector2d& undistorted, const Camera::Distortion& k) {
  const double x = undistorted.x(), y = undistorted.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

// The inverse of distort, by fixed-point iteration.
Eigen::Vector2d undistort(const Eigen::Vector2d& distorted, const Camera::Distortion& k) {
  Eigen::Vector2d undistorted = distorted;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::Vector2d step = distorted - distort(undistorted, k);
    undistorted += step;
    if (step.squaredNorm() < 1e-24) break;
  }
  return undistorted;
}

}  // namespace

Camera Camera::pinhole(int width, int height, double fx, double fy, double cx, double cy, const Distortion& distortion,
                       DepthKind depth_kind) {
  check_size(width, height);
  require(std::isfinite(fx) && fx != 0.0, "fx", "a finite focal length in pixels, not 0", fx);
  require(std::isfinite(fy) && fy != 0.0, "fy", "a finite focal length in pixels, not 0", fy);
  require(std::isfinite(cx), "cx", "finite", cx);
  require(std::isfinite(cy), "cy", "finite", cy);
  for (const double coefficient : distortion) require(std::isfinite(coefficient), "distortion", "finite", coefficient);

  Camera camera;
  camera.model_ = Model::pinhole;
  camera.width_ = width;
  camera.height_ = height;
  camera.fx_ = fx;
  camera.fy_ = fy;
  camera.cx_ = cx;
  camera.cy_ = cy;
  camera.distortion_ = distortion;
  camera.depth_kind_ = depth_kind;

  const bool distorted = distortion != Distortion{};
  auto rays = std::make_shared<std::vector<Ray>>();
  rays->reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      Eigen::Vector2d xy((u - cx) / fx, (v - cy) / fy);
      if (distorted) xy = undistort(xy, distortion);
      const double length = depth_kind == DepthKind::radial ? std::sqrt(1.0 + xy.squaredNorm()) : 1.0;
      rays->push_back({0.0F, 0.0F, static_cast<float>(xy.x() / length), static_cast<float>(xy.y() / length),
                       static_cast<float>(1.0 / length)});
    }
  }
  camera.rays_ = std::move(rays);
  return camera;
}

Camera Camera::orthographic(int width, int height, double pixel_size) {
  check_size(width, height);
  require(std::isfinite(pixel_size) && pixel_size > 0.0, "pixel_size", "a positive size in metres", pixel_size);

  Camera camera;
  camera.model_ = Model::orthographic;
  camera.width_ = width;
  camera.height_ = height;
  camera.fx_ = camera.fy_ = 1.0 / pixel_size;
  camera.cx_ = (width - 1) / 2.0;
  camera.cy_ = (height - 1) / 2.0;

  auto rays = std::make_shared<std::vector<Ray>>();
  rays->reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      rays->push_back({static_cast<float>((u - camera.cx_) * pixel_size),
                       static_cast<float>((v - camera.cy_) * pixel_size), 0.0F, 0.0F, 1.0F});
    }
  }
  camera.rays_ = std::move(rays);
  return camera;
}

Eigen::Vector2d Camera::project(const Eigen::Vector3d& point) const {
  if (model_ == Model::orthographic) return {point.x() * fx_ + cx_, point.y() * fy_ + cy_};
  if (!(point.z() > 0.0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector2d xy(point.x() / point.z(), point.y() / point.z());
  if (distortion_ != Distortion{}) xy = distort(xy, distortion_);
  return {xy.x() * fx_ + cx_, xy.y() * fy_ + cy_};
}

double Camera::depth_of(const Eigen::Vector3d& point) const {
  return depth_kind_ == DepthKind::radial ? point.norm() : point.z();
}

bool Camera::operator==(const Camera& other) const {
  return model_ == other.model_ && width_ == other.width_ && height_ == other.height_ && fx_ == other.fx_ &&
         fy_ == other.fy_ && cx_ == other.cx_ && cy_ == other.cy_ && distortion_ == other.distortion_ &&
         depth_kind_ == other.depth_kind_;
}

}  // namespace nacre
