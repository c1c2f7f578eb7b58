// How noisy a depth image is, told by the image itself.
#include <algorithm>
#include <cmath>

#include "depth_cleaning.hpp"
#include "parallel.hpp"
#include "planar_image.hpp"

namespace nacre {
namespace {

constexpr int kRadius = 3;  // windows of 7 x 7
constexpr int kStep = 5;    // between windows
constexpr std::size_t kMinSamples = 8;

// The residual variance of a quadratic surface fitted to the window about a pixel; NaN where a pixel is missing.
// The quadratic terms take up smooth curvature. Orthogonal polynomials on -3..3: 1, u, v, u v, u^2 - 4, v^2 - 4.
double residual_variance(const PlanarImage& image, int u, int v) {
  double sum = 0, sum_u = 0, sum_v = 0, sum_uv = 0, sum_uu = 0, sum_vv = 0, squares = 0;
  const double centre = image.row(v)[u];
  for (int dv = -kRadius; dv <= kRadius; ++dv) {
    const float* const row = image.row(v + dv) + u;
    for (int du = -kRadius; du <= kRadius; ++du) {
      const double value = row[du] - centre;
      sum += value;
      sum_u += du * value;
      sum_v += dv * value;
      sum_uv += du * dv * value;
      sum_uu += (du * du - 4) * value;
      sum_vv += (dv * dv - 4) * value;
      squares += value * value;
    }
  }
  const double explained = sum * sum / 49 + (sum_u * sum_u + sum_v * sum_v) / 196 + sum_uv * sum_uv / 784 +
                           (sum_uu * sum_uu + sum_vv * sum_vv) / 588;
  return std::max(squares - explained, 0.0) / (49 - 6);
}

float quantile(std::vector<float>& values, double part) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

NoiseModel estimate_noise(const DepthRef& depth, const Camera& camera, int num_threads) {
  return estimate_noise(PlanarImage(depth, camera, num_threads), camera, num_threads);
}

NoiseModel estimate_noise(const PlanarImage& image, const Camera& camera, int num_threads) {
  const bool pinhole = camera.model() == Camera::Model::pinhole;
  const NoiseModel shape = pinhole ? NoiseModel::kinect() : NoiseModel{1.0, 0.0, 0.0};
  const Quadratic shape_sigma = image.sigma(shape), slope = image.unit_slope();

  // Per window, in units of the shape: the residual's standard deviation, the smallest step between neighbours (of a
  // quantised image: one step), and the side of a pixel.
  struct Samples {
    std::vector<float> residuals, steps, pixels;
    Samples& operator+=(const Samples& other) {
      residuals.insert(residuals.end(), other.residuals.begin(), other.residuals.end());
      steps.insert(steps.end(), other.steps.begin(), other.steps.end());
      pixels.insert(pixels.end(), other.pixels.begin(), other.pixels.end());
      return *this;
    }
  };
  const int rows = std::max(0, (camera.height() - 1 - kRadius) / kStep);
  Samples samples = block_reduce<Samples>(rows, 4, num_threads, {}, [&](std::int64_t begin, std::int64_t end) {
    Samples found;
    for (std::int64_t row = begin; row < end; ++row) {
      const int v = kRadius + static_cast<int>(row) * kStep;
      for (int u = kRadius; u + kRadius < camera.width(); u += kStep) {
        const double variance = residual_variance(image, u, v);
        if (!(variance >= 0.0)) continue;
        const float value = image.row(v)[u], unit = shape_sigma(value);
        found.pixels.push_back(slope(value) / unit);
        if (variance > 0.0) found.residuals.push_back(static_cast<float>(std::sqrt(variance)) / unit);
        const float step = std::abs(image.row(v)[u + 1] - value);
        if (step > 0.0F) found.steps.push_back(step / unit);
      }
    }
    return found;
  });

  // Nothing to measure: the sensor's prior, or a tenth of a pixel.
  if (samples.pixels.size() < kMinSamples) {
    return pinhole ? shape : NoiseModel{0.1 * camera.pixel_size(), 0.0, 0.0};
  }
  double scale = 1e-3 * quantile(samples.pixels, 0.5);
  if (samples.residuals.size() >= kMinSamples) scale = std::max<double>(scale, quantile(samples.residuals, 0.4));
  if (samples.steps.size() >= kMinSamples) {
    scale = std::max<double>(scale, quantile(samples.steps, 0.1) / std::sqrt(12.0));
  }
  return {shape.constant * scale, shape.quadratic * scale, shape.offset};
}

}  // namespace nacre
