// How noisy a depth image is, told by the image itself.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "depth/coarse_depth.hpp"
#include "depth/limits.hpp"
#include "depth/restored_depth.hpp"
#include "depth/window_fits.hpp"

namespace nacre {
namespace {

std::int64_t count_values(const std::vector<float>& values) {
  std::int64_t count = 0;
  for (const float value : values) count += value == value ? 1 : 0;
  return count;
}

// Structured light and stereo match windows, so that their noise is a rough part, independent from pixel to pixel, and
// a smooth one that neighbours share. The smooth part's correlation is like exp(-(d / 3.3 pixels)^2), as measured on
// recordings of three such sensors. Of its variance, a quadratic surface fitted to 7 x 7 pixels leaves smooth_left
// over, and second differences see smooth_bent. Curved surfaces leave a little more over than they bend, which is not
// taken for a smooth part; and clean images leave nothing but curvature over, so that what is shared has a limit.

// The total variance by the one left over by fits, given the ratio of the variances by bends and by fits: solves
// fits = rough + smooth_left smooth, bends = rough + smooth_bent smooth.
double total_by_left(double bends_by_fits) {
  const double least = depth_limits::most_shared * depth_limits::smooth_left + (1.0 - depth_limits::most_shared);
  const double missing = std::max(0.0, depth_limits::independent - bends_by_fits);
  const double smooth = missing / (depth_limits::smooth_left - depth_limits::smooth_bent);
  const double rough = std::max(0.0, 1.0 - depth_limits::smooth_left * smooth);
  return std::min(rough + smooth, 1.0 / least);
}

// The ratio of the variances by bends and by fits, over the windows that stand between two whose residual is not above
// a limit: were they chosen by their own, the ratio would be too large.
double bends_by_fits(const WindowFits& fits, float limit) {
  const auto cols = static_cast<std::size_t>(fits.cols);
  double bends = 0.0, left = 0.0;
  for (std::size_t i = 1; i + 1 < fits.residual.size(); ++i) {
    const std::size_t column = i % cols;
    if (column == 0 || column + 1 == cols) continue;
    if (!(fits.residual[i - 1] <= limit) || !(fits.residual[i + 1] <= limit)) continue;
    const auto residual = static_cast<double>(fits.residual[i]);
    if (!(residual <= 2.0 * static_cast<double>(limit))) continue;  // an edge
    bends += static_cast<double>(fits.roughness[i]) * static_cast<double>(fits.roughness[i]);
    left += residual * residual;
  }
  return left > 0.0 ? bends / left : 1.0;
}

}  // namespace

double quantile(const std::vector<float>& values, double part) {
  // Floats that are not negative are ordered as their bits are: a histogram of the upper bits leaves few to sort.
  constexpr int shift = 20;
  const auto bin_of = [](float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits >> shift;
  };
  std::array<std::int32_t, 1 << (32 - shift)> histogram{};
  for (const float value : values) ++histogram[bin_of(value)];
  auto place = static_cast<std::ptrdiff_t>(part * static_cast<double>(count_values(values) - 1));
  std::uint32_t bin = 0;
  while (place >= histogram[bin]) place -= histogram[bin++];
  std::vector<float> candidates(static_cast<std::size_t>(histogram[bin]) + 1);
  std::size_t next = 0;
  for (const float value : values) {
    candidates[next] = value;
    next += bin_of(value) == bin;
  }
  candidates.pop_back();
  std::nth_element(candidates.begin(), candidates.begin() + place, candidates.end());
  return static_cast<double>(candidates[static_cast<std::size_t>(place)]);
}

NoiseModel sensor_prior(const Camera& camera) {
  return camera.model() == Camera::Model::pinhole ? NoiseModel::kinect() : NoiseModel{1.0, 0.0, 0.0, 0.0};
}

WindowFits fit_windows(const PlanarImage& image, const Camera& camera, const DepthUnit& unit, int num_threads) {
  const auto count = [](int size) { return std::max(0, (size - 2 * WindowFits::kRadius - 1) / WindowFits::kStep + 1); };
  WindowFits fits;
  fits.unit = unit;
  fits.cols = image.width() > 2 * WindowFits::kRadius ? count(image.width()) : 0;
  fits.rows = image.height() > 2 * WindowFits::kRadius ? count(image.height()) : 0;
  for (std::vector<float>* const values : {&fits.residual, &fits.roughness, &fits.pixel, &fits.step, &fits.slope}) {
    values->resize(static_cast<std::size_t>(fits.cols) * static_cast<std::size_t>(fits.rows));
  }
  // A step that no sensor's unit of depth explains is an edge: the worst, Kinect v1, has half of this.
  constexpr float any = infinity<float>;
  const bool pinhole = camera.model() == Camera::Model::pinhole;
  const simd::WindowRule rule = {image.sigma(sensor_prior(camera)), image.unit_slope(),
                                 pinhole ? std::sqrt(12.0F) : any, pinhole ? any : depth_limits::largest_step};
  const auto fit_row = simd::fit_windows();
  parallel_for(fits.rows, rows_per_block(fits.cols * WindowFits::kStep * WindowFits::kStep), num_threads,
               [&](std::int64_t row) {
                 const std::int64_t first = row * fits.cols;
                 fit_row(image.row(WindowFits::centre(static_cast<int>(row))) + WindowFits::centre(0), image.stride(),
                         fits.cols, rule,
                         {fits.residual.data() + first, fits.roughness.data() + first, fits.pixel.data() + first,
                          fits.step.data() + first, fits.slope.data() + first});
               });
  return fits;
}

WindowFits fits_of(const MaskRef& part, WindowFits fits) {
  for (int row = 0; row < fits.rows; ++row) {
    for (int column = 0; column < fits.cols; ++column) {
      if (part(WindowFits::centre(row), WindowFits::centre(column)) != 0) continue;
      const auto i = static_cast<std::size_t>(row * fits.cols + column);
      for (std::vector<float>* const values : {&fits.residual, &fits.roughness, &fits.pixel, &fits.step, &fits.slope}) {
        (*values)[i] = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
  return fits;
}

void NoiseModel::check() const {
  require(std::isfinite(constant) && constant >= 0.0, "noise.constant", "a finite number of metres, at least 0",
          constant);
  require(std::isfinite(quadratic) && quadratic >= 0.0, "noise.quadratic", "finite, at least 0", quadratic);
  require(std::isfinite(offset), "noise.offset", "finite", offset);
  require(shared >= 0.0 && shared < 1.0, "noise.shared", "a part from 0 to below 1", shared);
}

NoiseModel NoiseModel::local() const {
  const double part = std::sqrt(1.0 - shared * (1.0 - depth_limits::smooth_left));
  return {part * constant, part * quadratic, offset, 0.0};
}

NoiseModel NoiseModel::stereo(double fx, double baseline, double disparity_sigma) {
  require(std::isfinite(fx) && fx > 0.0, "fx", "a focal length in pixels", fx);
  require(std::isfinite(baseline) && baseline > 0.0, "baseline", "a positive distance in metres", baseline);
  require(std::isfinite(disparity_sigma) && disparity_sigma > 0.0, "disparity_sigma", "a positive number of pixels",
          disparity_sigma);
  return {0.0, disparity_sigma / (fx * baseline), 0.0, 0.0};
}

NoiseModel estimate_noise(const DepthRef& depth, const Camera& camera, int num_threads) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  const RestoredDepth restored(depth, camera, num_threads);
  const PlanarImage image(restored.image(), camera, num_threads);
  return estimate_noise(fit_windows(image, camera, restored.unit(), num_threads), camera, num_threads);
}

std::optional<NoiseScale> measure_noise(const WindowFits& fits, int num_threads) {
  const std::int64_t num_windows = count_values(fits.residual), num_steps = count_values(fits.step);
  if (num_windows < depth_limits::least_witnesses) return std::nullopt;
  const std::array<std::function<double()>, 3> parts = {
      // Below the median of the residuals: edges and fine structure leave more over than noise does.
      [&] { return quantile(fits.residual, depth_limits::noise_quantile); },
      [&] { return depth_limits::least_noise * quantile(fits.pixel, 0.5); },
      // Plateaus leave nothing over.
      [&] {
        const bool is_stepped =
            static_cast<double>(num_steps) > depth_limits::least_stepped * static_cast<double>(num_windows);
        return is_stepped ? quantile(fits.step, 0.5) / std::sqrt(12.0) : 0.0;
      }};
  std::array<double, 3> scales{};
  parallel_for(3, 1, num_threads, [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    scales[k] = parts[k]();
  });
  const double local = *std::max_element(scales.begin(), scales.end());
  const double total = scales[0] * std::sqrt(total_by_left(bends_by_fits(fits, static_cast<float>(scales[0]))));
  // Values that overflow where they are squared leave nothing to measure.
  if (!(local > 0.0 && std::isfinite(local) && std::isfinite(total))) return std::nullopt;
  return NoiseScale{local, std::max(local, total)};
}

NoiseModel scaled_prior(const Camera& camera, const NoiseScale& scale) {
  const NoiseModel shape = sensor_prior(camera);
  const double part = scale.local / scale.total, left = part * part;  // of the variance
  return {shape.constant * scale.total, shape.quadratic * scale.total, shape.offset,
          std::clamp((1.0 - left) / (1.0 - depth_limits::smooth_left), 0.0, depth_limits::most_shared)};
}

NoiseModel estimate_noise(const WindowFits& fits, const Camera& camera, int num_threads) {
  if (const std::optional<NoiseScale> scale = measure_noise(fits, num_threads)) {
    return with_unit(scaled_prior(camera, *scale), fits.unit);
  }
  // Nothing to measure: the sensor's prior, or a tenth of a pixel.
  return camera.model() == Camera::Model::pinhole
             ? sensor_prior(camera)
             : NoiseModel{depth_limits::unknown_noise * camera.pixel_size(), 0.0, 0.0, 0.0};
}

}  // namespace nacre
