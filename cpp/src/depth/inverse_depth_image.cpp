#include "depth/inverse_depth_image.hpp"

#include <cmath>
#include <string>

#include "base/parallel.hpp"
#include "camera/ray_table.hpp"
#include "simd/depth_points.hpp"

namespace nacre {

void require_camera_size(const char* name, Eigen::Index rows, Eigen::Index cols, const Camera& camera) {
  if (rows == camera.height() && cols == camera.width()) return;
  throw std::invalid_argument(std::string(name) + " must have the camera's size " + std::to_string(camera.width()) +
                              " x " + std::to_string(camera.height()) + " (width x height), got " +
                              std::to_string(cols) + " x " + std::to_string(rows));
}

PlanarImage::PlanarImage(const DepthRef& depth, const Camera& camera, int num_threads)
    : width_(camera.width()),
      height_(camera.height()),
      stride_(camera.width() + 2 * kBorder + kOverhang),
      inverse_(camera.model() == Camera::Model::pinhole),
      pixel_(static_cast<float>(1.0 / std::sqrt(std::abs(camera.fx() * camera.fy())))),
      values_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(camera.height() + 2 * kBorder)) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  constexpr float missing = std::numeric_limits<float>::quiet_NaN();
  const std::int64_t num_rows = height_ + 2 * kBorder;
  const bool is_radial = camera.depth_kind() == DepthKind::radial;
  const auto fill_row = simd::fill_planar_row();
  parallel_for(num_rows, rows_per_block(width_), num_threads, [&](std::int64_t row) {
    float* const start = values_.data() + row * stride_;
    const std::int64_t v = row - kBorder;
    if (v < 0 || v >= height_) {
      std::fill(start, start + stride_, missing);
      return;
    }
    float* const first = start + kBorder;
    std::fill(start, first, missing);
    fill_row(&depth.coeffRef(v, 0), is_radial ? camera.ray_table().row(static_cast<int>(v)).z : nullptr, inverse_,
             width_, first);
    std::fill(first + width_, start + stride_, missing);
  });
}

// 1/z changes by (1/z) / f between neighbouring pixels where z changes by z / f.
Quadratic PlanarImage::unit_slope() const {
  return inverse_ ? Quadratic{0.0F, pixel_, 0.0F} : Quadratic{pixel_, 0.0F, 0.0F};
}

// sigma(1/z) = sigma(z) / z^2 to first order.
Quadratic PlanarImage::sigma(const NoiseModel& noise) const {
  const auto square = static_cast<float>(noise.quadratic);
  const auto linear = static_cast<float>(-2.0 * noise.quadratic * noise.offset);
  const auto constant = static_cast<float>(noise.constant + noise.quadratic * noise.offset * noise.offset);
  return inverse_ ? Quadratic{square, linear, constant} : Quadratic{constant, linear, square};
}

}  // namespace nacre
