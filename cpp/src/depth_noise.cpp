// How noisy a depth image is, told by the image itself.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "parallel.hpp"
#include "window_fits.hpp"

namespace nacre {
namespace {

constexpr std::size_t kMinSamples = 8;

constexpr double kMinStepped = 0.1;     // of the windows of a coarsely quantised image cross from plateau to plateau
constexpr float kMaxStepPixels = 3.0F;  // orthographic: a larger step is an edge

// The value that would stand at `part` of the way if the values, none of them negative, were sorted.
float quantile(const std::vector<float>& values, double part) {
  // Floats that are not negative are ordered as their bits are: a histogram of the upper bits leaves few to sort.
  constexpr int shift = 20;
  const auto bin_of = [](float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits >> shift;
  };
  std::vector<std::int32_t> histogram(std::size_t{1} << (32 - shift));
  for (const float value : values) ++histogram[bin_of(value)];
  auto place = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::uint32_t bin = 0;
  while (place >= histogram[bin]) place -= histogram[bin++];
  std::vector<float> candidates;
  candidates.reserve(static_cast<std::size_t>(histogram[bin]));
  for (const float value : values) {
    if (bin_of(value) == bin) candidates.push_back(value);
  }
  std::nth_element(candidates.begin(), candidates.begin() + place, candidates.end());
  return candidates[static_cast<std::size_t>(place)];
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
  fits.step.resize(size);
  const auto fit_row = simd::fit_windows();
  parallel_for(
      fits.rows, rows_per_block(fits.cols * WindowFits::kStep * WindowFits::kStep), num_threads, [&](std::int64_t row) {
        const std::int64_t first = row * fits.cols;
        fit_row(image.row(WindowFits::centre(static_cast<int>(row))) + WindowFits::centre(0), image.stride(), fits.cols,
                {fits.residual.data() + first, fits.slope.data() + first, fits.step.data() + first});
      });
  return fits;
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
  for (std::vector<float>* const values : {&residuals, &steps, &pixels}) values->reserve(fits.residual.size());
  for (int row = 0; row < fits.rows; ++row) {
    const float* const values = image.row(WindowFits::centre(row));
    for (int col = 0; col < fits.cols; ++col) {
      const auto i = static_cast<std::size_t>(row * fits.cols + col);
      if (!(fits.residual[i] >= 0.0F)) continue;
      const float value = values[WindowFits::centre(col)];
      const float unit = 1.0F / evaluate(shape_sigma, value), pixel = evaluate(unit_slope, value) * unit;
      residuals.push_back(fits.residual[i] * unit);
      pixels.push_back(pixel);
      const float step = fits.step[i] * unit;
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
