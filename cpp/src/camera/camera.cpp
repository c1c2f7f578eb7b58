#include "nacre/camera.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/pose_check.hpp"
#include "camera/ray_table.hpp"

namespace nacre {
namespace {

void check_size(int width, int height) {
  require(width > 0 && width <= 1 << 16, "width", "1 to 65536 pixels", width);
  require(height > 0 && height <= 1 << 16, "height", "1 to 65536 pixels", height);
  require(height <= (1 << 28) / width, "height", "of an image of at most 2^28 pixels",
          height);  // int has their indices
}

// Normalised coordinates (x / z, y / z) of an undistorted ray to those of the distorted image, Brown-Conrady.
Eigen::Vector2d distort(const Eigen::Vector2d& undistorted, const Camera::Distortion& k) {
  const double x = undistorted.x(), y = undistorted.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

// The r^2 at which r (1 + k1 r^2 + k2 r^4 + k3 r^6) stops growing; infinite where it always grows.
double turning_point(const Camera::Distortion& k) {
  constexpr double reach = 100.0, step = 1e-3;  // 84 degrees off the axis
  const auto growth = [&k](double r2) { return 1.0 + r2 * (3.0 * k[0] + r2 * (5.0 * k[1] + r2 * 7.0 * k[4])); };
  for (double r2 = 0.0; r2 < reach; r2 += step) {
    if (growth(r2) <= 0.0) return r2;
  }
  return infinity<double>;
}

// The inverse of distort by Newton's method, which converges from one side below the turning point; NaN beyond it.
Eigen::Vector2d undistort(const Eigen::Vector2d& distorted, const Camera::Distortion& k, double max_radius_squared) {
  Eigen::Vector2d undistorted = distorted;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double x = undistorted.x(), y = undistorted.y(), r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    const double slope = k[0] + r2 * (2.0 * k[1] + r2 * 3.0 * k[4]);
    const double mixed = 2.0 * (x * y * slope + k[2] * x + k[3] * y);
    Eigen::Matrix2d jacobian;
    jacobian << radial + 2.0 * x * x * slope + 2.0 * k[2] * y + 6.0 * k[3] * x, mixed, mixed,
        radial + 2.0 * y * y * slope + 6.0 * k[2] * y + 2.0 * k[3] * x;
    const Eigen::Vector2d step = jacobian.inverse() * (distorted - distort(undistorted, k));
    undistorted += step;
    if (!(step.squaredNorm() > 1e-24 * (1.0 + r2))) break;
  }
  const bool found = undistorted.squaredNorm() <= max_radius_squared &&
                     (distort(undistorted, k) - distorted).squaredNorm() <= 1e-18 * (1.0 + distorted.squaredNorm());
  return found ? undistorted : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// The largest |x / z| of the rays of a row, or |y / z| of a column, of `size` pixels.
double steepest_ray(int size, double focal_length, double centre) {
  return std::max(std::abs(centre), std::abs(size - 1 - centre)) / std::abs(focal_length);
}

// Vectors may read beyond the last value.
std::size_t padded(std::size_t size) { return size + 15; }

// Rays along the axis through the origin.
RayTable empty_table(int width, int height) {
  RayTable rays;
  rays.width = width;
  const auto columns = padded(static_cast<std::size_t>(width)), rows = static_cast<std::size_t>(height);
  rays.x.assign(columns, 0.0F);
  rays.y.assign(rows, 0.0F);
  rays.z.assign(columns, 1.0F);
  rays.origin_x.assign(columns, 0.0F);
  rays.origin_y.assign(rows, 0.0F);
  return rays;
}

// How pixels follow the rays' (x / z, y / z), by central differences.
void differentiate(int height, RayTable& rays) {
  const int width = static_cast<int>(rays.width);
  const auto index = [width](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  const auto xy = [&](int u, int v) {
    const std::size_t i = index(u, v);
    return Eigen::Vector2f(rays.x[i] / rays.z[i], rays.y[i] / rays.z[i]);
  };
  for (std::vector<float>& values : rays.pixel_from_ray) values.assign(rays.x.size(), 0.0F);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int l = std::max(u - 1, 0), r = std::min(u + 1, width - 1);
      const int t = std::max(v - 1, 0), b = std::min(v + 1, height - 1);
      Eigen::Matrix2f ray_from_pixel;
      ray_from_pixel << (xy(r, v) - xy(l, v)) / static_cast<float>(std::max(r - l, 1)),
          (xy(u, b) - xy(u, t)) / static_cast<float>(std::max(b - t, 1));
      const Eigen::Matrix2f inverse = ray_from_pixel.inverse();
      for (int k = 0; k < 4; ++k) rays.pixel_from_ray[static_cast<std::size_t>(k)][index(u, v)] = inverse(k / 2, k % 2);
    }
  }
}

}  // namespace

Camera Camera::pinhole(int width, int height, double fx, double fy, double cx, double cy, const Distortion& distortion,
                       DepthKind depth_kind, int binning) {
  require(binning >= 1, "binning", "at least 1", binning);
  check_size(width, height);
  require(std::isfinite(fx) && fx != 0.0, "fx", "a finite focal length in pixels, not 0", fx);
  require(std::isfinite(fy) && fy != 0.0, "fy", "a finite focal length in pixels, not 0", fy);
  require(std::isfinite(cx), "cx", "finite", cx);
  require(std::isfinite(cy), "cy", "finite", cy);
  for (const double coefficient : distortion) require(std::isfinite(coefficient), "distortion", "finite", coefficient);
  constexpr const char* finite_rays = "a focal length that leaves the rays of all pixels finite";
  require(steepest_ray(width, fx, cx) <= std::numeric_limits<float>::max(), "fx", finite_rays, fx);
  require(steepest_ray(height, fy, cy) <= std::numeric_limits<float>::max(), "fy", finite_rays, fy);

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
  camera.binning_ = binning;

  const bool distorted = distortion != Distortion{};
  if (distorted) camera.max_radius_squared_ = turning_point(distortion);
  RayTable rays = empty_table(width, height);
  if (!distorted && depth_kind == DepthKind::z) {
    for (int u = 0; u < width; ++u) rays.x[static_cast<std::size_t>(u)] = static_cast<float>((u - cx) / fx);
    for (int v = 0; v < height; ++v) rays.y[static_cast<std::size_t>(v)] = static_cast<float>((v - cy) / fy);
  } else {
    rays.is_grid = false;
    const std::size_t size = padded(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::vector<float>* const values : {&rays.x, &rays.y, &rays.z}) values->assign(size, 0.0F);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        Eigen::Vector2d xy((u - cx) / fx, (v - cy) / fy);
        if (distorted) xy = undistort(xy, distortion, camera.max_radius_squared_);
        const double length = depth_kind == DepthKind::radial ? std::sqrt(1.0 + xy.squaredNorm()) : 1.0;
        const std::size_t i =
            static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
        rays.x[i] = static_cast<float>(xy.x() / length);
        rays.y[i] = static_cast<float>(xy.y() / length);
        rays.z[i] = static_cast<float>(1.0 / length);
      }
    }
    if (distorted) differentiate(height, rays);
  }
  camera.rays_ = std::make_shared<const RayTable>(std::move(rays));
  return camera;
}

Camera Camera::orthographic(int width, int height, double pixel_size) {
  check_size(width, height);
  require(std::isfinite(pixel_size) && pixel_size > 0.0, "pixel_size", "a positive size in metres", pixel_size);
  require(pixel_size >= std::numeric_limits<float>::min() && pixel_size * std::max(width, height) <= farthest_place,
          "pixel_size", "a size in metres that single precision tells from 0, of an image at most 1e30 m across",
          pixel_size);

  Camera camera;
  camera.model_ = Model::orthographic;
  camera.width_ = width;
  camera.height_ = height;
  camera.pixel_size_ = pixel_size;
  camera.fx_ = camera.fy_ = 1.0 / pixel_size;
  camera.cx_ = (width - 1) / 2.0;
  camera.cy_ = (height - 1) / 2.0;

  RayTable rays = empty_table(width, height);
  for (int u = 0; u < width; ++u) {
    rays.origin_x[static_cast<std::size_t>(u)] = static_cast<float>((u - camera.cx_) * pixel_size);
  }
  for (int v = 0; v < height; ++v) {
    rays.origin_y[static_cast<std::size_t>(v)] = static_cast<float>((v - camera.cy_) * pixel_size);
  }
  camera.rays_ = std::make_shared<const RayTable>(std::move(rays));
  return camera;
}

Ray Camera::ray(int u, int v) const {
  const simd::RayRow row = rays_->row(v);
  return {row.origin_x[u], row.origin_y, row.x[u], row.y != nullptr ? row.y[u] : row.row_y, row.z[u]};
}

Eigen::Vector2d Camera::project(const Eigen::Vector3d& point) const {
  if (model_ == Model::orthographic) return {point.x() * fx_ + cx_, point.y() * fy_ + cy_};
  Eigen::Vector2d xy(point.x() / point.z(), point.y() / point.z());
  if (!(point.z() > 0.0 && xy.squaredNorm() <= max_radius_squared_)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  if (distortion_ != Distortion{}) xy = distort(xy, distortion_);
  return {xy.x() * fx_ + cx_, xy.y() * fy_ + cy_};
}

double Camera::depth_of(const Eigen::Vector3d& point) const {
  return depth_kind_ == DepthKind::radial ? point.norm() : point.z();
}

Camera Camera::binned(int factor) const {
  if (factor == 1) return *this;
  require(model_ == Model::pinhole, "binning", "0 or 1 unless the camera is a pinhole", factor);
  require(factor >= 1 && factor <= std::min(width_, height_), "binning", "at most the sides of the image", factor);
  const double shift = 0.5 * (factor - 1);
  return pinhole(width_ / factor, height_ / factor, fx_ / factor, fy_ / factor, (cx_ - shift) / factor,
                 (cy_ - shift) / factor, distortion_, depth_kind_, factor * binning_);
}

bool Camera::operator==(const Camera& other) const {
  return model_ == other.model_ && width_ == other.width_ && height_ == other.height_ && fx_ == other.fx_ &&
         fy_ == other.fy_ && cx_ == other.cx_ && cy_ == other.cy_ && distortion_ == other.distortion_ &&
         depth_kind_ == other.depth_kind_ && binning_ == other.binning_;
}

}  // namespace nacre
