// The noise of a sensor, pooled over the images of a recording.
#include <algorithm>
#include <cmath>
#include <vector>

#include "depth/coarse_depth.hpp"
#include "depth/limits.hpp"
#include "depth/restored_depth.hpp"
#include "depth/window_fits.hpp"
#include "nacre/depth.hpp"

namespace nacre {
namespace {

// The noise at some depth [m], by so many windows.
struct MeasuredNoise {
  double z, sigma, weight;
};

// c and q, not negative, of c + q s_i = 1 in the sense of weighted least squares.
struct CurveFit {
  double cc = 0.0, cq = 0.0, qq = 0.0, c = 0.0, q = 0.0, weight = 0.0;

  void add(double per_c, double per_q, double w) {
    cc += w * per_c * per_c;
    cq += w * per_c * per_q;
    qq += w * per_q * per_q;
    c += w * per_c;
    q += w * per_q;
    weight += w;
  }

  std::pair<double, double> solve() const {
    const double determinant = cc * qq - cq * cq;
    const double constant = (c * qq - q * cq) / determinant, quadratic = (q * cc - c * cq) / determinant;
    if (constant < 0.0) return {0.0, q / qq};
    if (quadratic < 0.0) return {c / cc, 0.0};
    return {constant, quadratic};
  }
  // The weighted sum of the squared residuals.
  double misfit(double constant, double quadratic) const {
    return weight - 2.0 * (constant * c + quadratic * q) + constant * constant * cc + 2.0 * constant * quadratic * cq +
           quadratic * quadratic * qq;
  }
};

struct NoiseCurve {
  NoiseModel model;
  double misfit;
};

// Of the offset of another, to whose shape it is drawn: one depth tells nothing of that.
NoiseCurve curve_through(const std::vector<MeasuredNoise>& measured, const NoiseModel& expected) {
  CurveFit fit;
  for (const auto& [z, sigma, weight] : measured) {
    const double beyond = z - expected.offset;
    fit.add(1.0 / sigma, beyond * beyond / sigma, weight);
  }
  CurveFit drawn = fit;
  drawn.add(1.0 / expected.constant, 0.0, depth_limits::prior_weight * fit.weight);
  drawn.add(0.0, 1.0 / expected.quadratic, depth_limits::prior_weight * fit.weight);
  const auto [constant, quadratic] = drawn.solve();
  return {{constant, quadratic, expected.offset, 0.0}, fit.misfit(constant, quadratic)};
}

// Of a bin of depth.
double middle_of(std::size_t bin) {
  return depth_limits::nearest_bin * std::exp2((static_cast<double>(bin) + 0.5) / depth_limits::bins_per_octave);
}

// What triangulation is expected to come to: noise that begins at the camera, half of it there at the middle depth.
NoiseModel triangulation(const std::vector<MeasuredNoise>& measured, const NoiseModel& prior) {
  double weights = 0.0, logarithms = 0.0;
  for (const auto& [z, sigma, weight] : measured) {
    weights += weight;
    logarithms += weight * std::log(z);
  }
  const double depth = std::exp(logarithms / weights), half = 0.5 * prior.sigma(depth);
  return {half, half / (depth * depth), 0.0, 0.0};
}

}  // namespace

NoiseCalibration::NoiseCalibration(const Camera& camera) : camera_(camera) {}

void NoiseCalibration::add(const DepthRef& depth, int num_threads) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera_);
  const RestoredDepth restored(depth, camera_, num_threads);
  const PlanarImage image(restored.image(), camera_, num_threads);
  add(image, fit_windows(image, camera_, restored.unit(), num_threads), num_threads);
}

void NoiseCalibration::add(const PlanarImage& image, const WindowFits& fits, int num_threads) {
  if (fits.unit.at(1.0) > unit_.at(1.0)) unit_ = fits.unit;
  const std::optional<NoiseScale> scale = measure_noise(fits, num_threads);
  if (!scale) return;
  const auto pool = [](Mean& mean, double value) {
    mean.count = std::min(mean.count + 1.0, depth_limits::most_frames);
    mean.value += (value - mean.value) / mean.count;
  };
  pool(local_, std::log(scale->local));
  pool(total_, std::log(scale->total));
  if (camera_.model() != Camera::Model::pinhole) return;

  std::array<std::vector<float>, num_bins> residuals;
  for (int row = 0; row < fits.rows; ++row) {
    const float* const values = image.row(WindowFits::centre(row));
    for (int column = 0; column < fits.cols; ++column) {
      const float residual = fits.residual[static_cast<std::size_t>(row * fits.cols + column)];
      if (!(residual >= 0.0F)) continue;
      const double z = 1.0 / static_cast<double>(values[WindowFits::centre(column)]);
      const double bin = std::floor(depth_limits::bins_per_octave * std::log2(z / depth_limits::nearest_bin));
      if (bin < 0.0 || bin >= static_cast<double>(num_bins)) continue;
      residuals[static_cast<std::size_t>(bin)].push_back(residual);
    }
  }
  for (std::size_t bin = 0; bin < num_bins; ++bin) {
    if (static_cast<std::int64_t>(residuals[bin].size()) < depth_limits::least_witnesses) continue;
    const double typical = quantile(residuals[bin], depth_limits::noise_quantile);
    if (!(typical > 0.0)) continue;
    pool(bins_[bin], std::log(typical));
    pool(windows_[bin], static_cast<double>(residuals[bin].size()));
  }
  pool(fitted_, std::log(std::max(quantile(fits.residual, depth_limits::noise_quantile), 1e-6)));
}

double NoiseCalibration::unit() const {
  double logarithms = 0.0, weights = 0.0;
  for (std::size_t bin = 0; bin < num_bins; ++bin) {
    const double weight = windows_[bin].count * windows_[bin].value;
    logarithms += weight * std::log(middle_of(bin));
    weights += weight;
  }
  return unit_.at(weights > 0.0 ? std::exp(logarithms / weights) : 1.0);
}

NoiseModel NoiseCalibration::model() const {
  if (local_.count == 0.0) return estimate_noise(WindowFits{}, camera_, 1);
  NoiseModel model = scaled_prior(camera_, {std::exp(local_.value), std::exp(total_.value)});
  if (camera_.model() != Camera::Model::pinhole) return with_unit(model, unit_);

  // The curve's shape, where the recording shows several depths: relative to what the fits leave over on the whole.
  const NoiseModel prior = sensor_prior(camera_);
  std::vector<MeasuredNoise> measured;
  for (std::size_t bin = 0; bin < num_bins; ++bin) {
    if (bins_[bin].count == 0.0) continue;
    const double z = middle_of(bin);
    const double sigma = prior.sigma(z) * std::exp(bins_[bin].value - fitted_.value);
    measured.push_back({z, sigma, windows_[bin].count * windows_[bin].value});
  }
  if (measured.empty()) return with_unit(model, unit_);
  const NoiseCurve as_prior = curve_through(measured, prior);
  const NoiseCurve triangulated = curve_through(measured, triangulation(measured, prior));
  const NoiseModel& curve = triangulated.misfit < as_prior.misfit ? triangulated.model : as_prior.model;
  const double scale = std::exp(total_.value);
  model.constant = scale * curve.constant;
  model.quadratic = scale * curve.quadratic;
  model.offset = curve.offset;
  return with_unit(model, unit_);
}

}  // namespace nacre
