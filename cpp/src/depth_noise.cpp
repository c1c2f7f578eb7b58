// How noisy a depth image is, told by the image itself.
#include <algorithm>
#include <cmath>

#include "parallel.hpp"
#include "window_fits.hpp"

namespace nacre {
namespace {

constexpr std::size_t kMinSamples = 8;

constexpr double kMinStepped = 0.1;     // of the windows of a coarsely quantised image cross from plateau to plateau
constexpr float kMaxStepPixels = 3.0F;  // orthographic: a larger step is an edge

struct Fit {
  double variance, slope;
};

// Orthogonal polynomials on -3..3: 1, u, v, u v, u^2 - 4, v^2 - 4. The quadratic ones take up smooth curvature.
Fit fit_window(const PlanarImage& image, int u, int v) {
  static_assert(WindowFits::kRadius == 3);
  double sum = 0, sum_u = 0, sum_v = 0, sum_uv = 0, sum_uu = 0, sum_vv = 0, squares = 0;
  const double centre = image.row(v)[u];
  for (int dv = -3; dv <= 3; ++dv) {
    const float* const row = image.row(v + dv) + u;
    for (int du = -3; du <= 3; ++du) {
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
  return {std::max(squares - explained, 0.0) / (49 - 6), std::hypot(sum_u, sum_v) / 196};
}

// The smallest step from one plateau to the next along a window's central row and column; 0 where there are not
// both: plateaus, and steps.
float plateau_step(const PlanarImage& image, int u, int v) {
  int num_flat = 0;
  float smallest = std::numeric_limits<float>::infinity();
  const auto add = [&](float step) {
    if (step == 0.0F) {
      ++num_flat;
    } else {
      smallest = std::min(smallest, step);
    }
  };
  const float* const pixel = image.row(v) + u;
  for (int d = -WindowFits::kRadius; d < WindowFits::kRadius; ++d) {
    add(std::abs(pixel[d + 1] - pixel[d]));
    add(std::abs(pixel[(d + 1) * image.stride()] - pixel[d * image.stride()]));
  }
  return num_flat >= 2 * WindowFits::kRadius && std::isfinite(smallest) ? smallest : 0.0F;
}

float quantile(std::vector<float>& values, double part) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

WindowFits fit_windows(const PlanarImage& image, int num_threads) {
  const auto count = [](int size) { return std::max(0, (size - 2 * WindowFits::kRadius - 1) / WindowFits::kStep + 1); };
  WindowFits fits;
  fits.cols = image.width() > 2 * WindowFits::kRadius ? count(image.width()) : 0;
  fits.rows = image.height() > 2 * WindowFits::kRadius ? count(image.height()) : 0;
  const auto size = static_cast<std::size_t>(fits.cols) * static_cast<std::size_t>(fits.rows);
  fits.residual.resize(size);
  fits.slope.resize(size);
  parallel_for(
      fits.rows, rows_per_block(fits.cols * WindowFits::kStep * WindowFits::kStep), num_threads, [&](std::int64_t row) {
        for (int col = 0; col < fits.cols; ++col) {
          const Fit fit = fit_window(image, WindowFits::centre(col), WindowFits::centre(static_cast<int>(row)));
          const auto i = static_cast<std::size_t>(row * fits.cols + col);
          // std::max(NaN, 0) is NaN: a window with a missing pixel has no residual.
          fits.residual[i] = static_cast<float>(std::sqrt(fit.variance));
          fits.slope[i] = static_cast<float>(fit.slope);
        }
      });
  return fits;
}

std::vector<float> smooth_slopes(const WindowFits& fits) {
  std::vector<float> slopes(fits.slope.size());
  for (int row = 0; row < fits.rows; ++row) {
    for (int col = 0; col < fits.cols; ++col) {
      float least = std::numeric_limits<float>::infinity();
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, fits.rows - 1); ++r) {
        for (int c = std::max(col - 1, 0); c <= std::min(col + 1, fits.cols - 1); ++c) {
          const float slope = fits.slope[static_cast<std::size_t>(r * fits.cols + c)];
          if (slope < least) least = slope;
        }
      }
      slopes[static_cast<std::size_t>(row * fits.cols + col)] = std::isfinite(least) ? least : 0.0F;
    }
  }
  return slopes;
}

NoiseModel estimate_noise(const DepthRef& depth, const Camera& camera, int num_threads) {
  const PlanarImage image(depth, camera, num_threads);
  return estimate_noise(image, fit_windows(image, num_threads), camera);
}

NoiseModel estimate_noise(const PlanarImage& image, const WindowFits& fits, const Camera& camera) {
  const bool pinhole = camera.model() == Camera::Model::pinhole;
  const NoiseModel shape = pinhole ? NoiseModel::kinect() : NoiseModel{1.0, 0.0, 0.0};
  const Quadratic shape_sigma = image.sigma(shape), unit_slope = image.unit_slope();

  // In units of the shape: the residuals, the steps of plateaus, the side of a pixel. A step that no sensor's unit of
  // depth explains is an edge: the worst, Kinect v1, has half of max_step.
  const float max_step = std::sqrt(12.0F);
  std::vector<float> residuals, steps, pixels;
  for (int row = 0; row < fits.rows; ++row) {
    for (int col = 0; col < fits.cols; ++col) {
      const float residual = fits.residual[static_cast<std::size_t>(row * fits.cols + col)];
      if (!(residual >= 0.0F)) continue;
      const int u = WindowFits::centre(col), v = WindowFits::centre(row);
      const float value = image.row(v)[u], unit = 1.0F / shape_sigma(value), pixel = unit_slope(value) * unit;
      residuals.push_back(residual * unit);
      pixels.push_back(pixel);
      const float step = plateau_step(image, u, v) * unit;
      if (step > 0.0F && step <= (pinhole ? max_step : kMaxStepPixels * pixel)) steps.push_back(step);
    }
  }

  // Nothing to measure: the sensor's prior, or a tenth of a pixel.
  if (pixels.size() < kMinSamples) return pinhole ? shape : NoiseModel{0.1 * camera.pixel_size(), 0.0, 0.0};

  // Below the median of the residuals: edges and fine structure leave more over than noise does.
  double scale = std::max(1e-3 * quantile(pixels, 0.5), static_cast<double>(quantile(residuals, 0.4)));
  // Plateaus leave nothing over.
  if (static_cast<double>(steps.size()) > kMinStepped * static_cast<double>(pixels.size())) {
    scale = std::max(scale, quantile(steps, 0.5) / std::sqrt(12.0));
  }
  return {shape.constant * scale, shape.quadratic * scale, shape.offset};
}

}  // namespace nacre
