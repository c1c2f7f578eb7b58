/// Camera models. To all of them, the point seen by a pixel is origin + depth * direction.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "nacre/types.hpp"

namespace nacre {

/// What a depth value measures: the distance along the optical axis, or along the pixel's ray.
enum class DepthKind { z, radial };

/// The line of sight of a pixel in the camera frame (x right, y down, z forward): point = origin + depth * direction.
/// Pinhole: the origin is 0; direction.z is 1 for DepthKind::z, direction has length 1 for DepthKind::radial.
/// Orthographic: the direction is (0, 0, 1).
struct Ray {
  float origin_x, origin_y;
  float direction_x, direction_y, direction_z;
};

struct RayTable;

/// An immutable camera; copies are cheap and share the ray table. Pixel centres are integers.
class Camera {
 public:
  /// How rays run: through one point, or in parallel.
  enum class Model { pinhole, orthographic };
  /// Brown-Conrady coefficients k1 k2 p1 p2 k3 (OpenCV's order).
  using Distortion = std::array<double, 5>;

  /// x = (u - cx) z / fx. binning: each pixel is the mean of so many by so many of the sensor's, which tells how far
  /// apart points are. Throws std::invalid_argument naming the argument that is out of range.
  static Camera pinhole(int width, int height, double fx, double fy, double cx, double cy,
                        const Distortion& distortion = {}, DepthKind depth_kind = DepthKind::z, int binning = 1);
  /// x = (u - (width - 1) / 2) pixel_size, y likewise [m].
  static Camera orthographic(int width, int height, double pixel_size);
  /// The pinhole camera whose pixels are the means of blocks of factor x factor of this one's; columns and rows that
  /// fill no block are left out. 1: this one. Throws std::invalid_argument naming `binning` where there is none.
  Camera binned(int factor) const;

  Model model() const { return model_; }
  int width() const { return width_; }
  int height() const { return height_; }
  double fx() const { return fx_; }  ///< [pixels]; 1 / pixel_size for an orthographic camera
  double fy() const { return fy_; }
  double cx() const { return cx_; }
  double cy() const { return cy_; }
  const Distortion& distortion() const { return distortion_; }
  DepthKind depth_kind() const { return depth_kind_; }
  int binning() const { return binning_; }
  double pixel_size() const { return pixel_size_; }  ///< [m]; 0 for a pinhole camera

  /// The ray of pixel (u, v); NaN where the distortion model ends before the image does.
  Ray ray(int u, int v) const;
  /// All rays, as the library itself reads them.
  const RayTable& ray_table() const { return *rays_; }

  /// The pixel (u, v) that sees a point of the camera frame, distortion included; NaN behind a pinhole camera, and
  /// where the distortion model has ended: beyond its turning point it would fold far-off points back into the image.
  Eigen::Vector2d project(const Eigen::Vector3d& point) const;

  /// The depth value of a point of the camera frame, in this camera's depth kind [m].
  double depth_of(const Eigen::Vector3d& point) const;

  /// The side of a pixel on a surface that faces the camera at a distance z [m].
  double footprint(double z) const { return model_ == Model::pinhole ? z / std::abs(fx_) : pixel_size_; }

  bool operator==(const Camera& other) const;
  bool operator!=(const Camera& other) const { return !(*this == other); }

 private:
  Camera() = default;

  Model model_ = Model::pinhole;
  int width_ = 0, height_ = 0;
  double fx_ = 0, fy_ = 0, cx_ = 0, cy_ = 0, pixel_size_ = 0;
  Distortion distortion_{};
  double max_radius_squared_ = std::numeric_limits<double>::infinity();  // of x^2 + y^2, where the distortion turns
  DepthKind depth_kind_ = DepthKind::z;
  int binning_ = 1;
  std::shared_ptr<const RayTable> rays_;
};

}  // namespace nacre
