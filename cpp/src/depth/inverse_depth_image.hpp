// The image in which every plane is an affine function of the pixel: inverse depth 1/z for a pinhole camera, depth for
// an orthographic one. Edge tests, noise estimate and normals all work on it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/scratch.hpp"
#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "simd/depth_row.hpp"

namespace nacre {

using simd::Quadratic;

inline float evaluate(const Quadratic& q, float x) { return q.constant + x * (q.linear + x * q.square); }
inline Quadratic operator*(const Quadratic& q, float factor) {
  return {q.constant * factor, q.linear * factor, q.square * factor};
}

class PlanarImage {
 public:
  // NaN on every side, so that windows need no bounds checks, and on the right so many more that vectors need none.
  static constexpr int kBorder = simd::largest_normal_window, kOverhang = 31;

  // Throws std::invalid_argument when depth and camera differ in size.
  PlanarImage(const DepthRef& depth, const Camera& camera, int num_threads);

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return stride_; }
  // The first pixel of row v; columns and rows may be addressed from -kBorder on.
  const float* row(int v) const { return values_.data() + (v + kBorder) * stride_ + kBorder; }

  simd::PlanarRow planar_row(int v) const { return {row(v), stride_, width_, inverse_}; }

  // The change of the value between neighbouring pixels on a surface of slope 1 (slanted by 45 degrees), given the
  // value: a slant s changes it by tan(s) times as much.
  Quadratic unit_slope() const;
  // The standard deviation of the value, given the value.
  Quadratic sigma(const NoiseModel& noise) const;

 private:
  int width_, height_;
  std::ptrdiff_t stride_;
  bool inverse_;
  float pixel_;  // the side of a pixel at distance 1 (pinhole), or everywhere (orthographic)
  Scratch<float> values_;
};

// Rows that are worth a thread's while, for images of this width.
inline std::int64_t rows_per_block(std::int64_t width) {
  return std::max<std::int64_t>(1, 8192 / std::max<std::int64_t>(1, width));
}

inline bool is_measurement(float depth) { return depth > 0.0F && depth <= std::numeric_limits<float>::max(); }

// Throws std::invalid_argument unless an image of this size belongs to the camera.
void require_camera_size(const char* name, Eigen::Index rows, Eigen::Index cols, const Camera& camera);

}  // namespace nacre
