#include "depth/cleaning.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "base/statistics.hpp"
#include "camera/ray_table.hpp"
#include "depth/cleaning.hpp"
#include "depth/edges.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"
#include "depth/restored_depth.hpp"
#include "depth/speckles.hpp"
#include "depth/window_fits.hpp"
#include "nacre/depth_calibration.hpp"
#include "simd/depth_edges.hpp"
#include "simd/depth_keep.hpp"

namespace nacre {
namespace {

// A wrong depth_scale shows as a median depth that no depth camera measures. A sample of the pixels tells enough.
void require_plausible_median(const DepthRef& depth) {
  const std::int64_t stride = std::max<std::int64_t>(1, depth.size() / depth_limits::most_probes);
  std::vector<float> sample;
  sample.reserve(static_cast<std::size_t>(depth.size() / stride + 1));
  std::size_t num_near = 0, num_far = 0;
  for (std::int64_t i = 0, v = 0, u = 0; i < depth.size(); i += stride, u += stride) {
    for (; u >= depth.cols(); u -= depth.cols()) ++v;
    const float z = depth(v, u);
    if (!is_measurement(z)) continue;
    sample.push_back(z);
    num_near += z < depth_limits::nearest_median;
    num_far += z > depth_limits::farthest_median;
  }
  const std::size_t half = sample.size() / 2;
  if (sample.empty() || (num_near <= half && num_far < sample.size() - half)) return;
  std::ostringstream message;
  message << "depth must be in metres with a median of 0.05 to 50 m, got a median of " << median_of(std::move(sample))
          << " m: check depth_scale, the stored units per metre (1000 for millimetres, 5000 for TUM RGB-D)";
  throw std::invalid_argument(message.str());
}

ByteImage mark_edges(const DepthRef& depth, const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                     const DepthOptions& options, int num_threads) {
  switch (options.edge_test) {
    case EdgeTest::gradient:
      return mark_gradient_edges(depth, options, num_threads);
    case EdgeTest::inverse_depth:
      return mark_planar_edges(image, fits, noise, options, num_threads);
    case EdgeTest::none:
      break;
  }
  ByteImage none(image.width(), image.height());
  std::fill(none.row(0), none.row(image.height()), std::uint8_t{0});
  return none;
}

// The nearest floats that are not beyond a limit.
float round_up(double limit) {
  const auto rounded = static_cast<float>(limit);
  return rounded < limit ? std::nextafter(rounded, infinity<float>) : rounded;
}
float round_down(double limit) {
  const auto rounded = static_cast<float>(limit);
  return rounded > limit ? std::nextafter(rounded, 0.0F) : rounded;
}

// The pixels that hold a measurement within range and mask and bear no mark.
ByteImage keep_pixels(const DepthRef& depth, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                      const ByteImage& marks, int num_threads, DepthReport& report) {
  const int width = camera.width(), height = camera.height();
  const float min_depth = round_up(options.min_depth), max_depth = round_down(options.max_depth);
  ByteImage keep(width, height);
  std::vector<simd::KeepCounts> counts(static_cast<std::size_t>(height));
  const auto keep_row = simd::keep_pixels();
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
    counts[static_cast<std::size_t>(v)] =
        keep_row({&depth.coeffRef(v, 0), camera.ray_table().row(static_cast<int>(v)).x,
                  mask.size() > 0 ? &mask.coeffRef(v, 0) : nullptr, marks.row(v), min_depth, max_depth, width},
                 keep.row(v));
  });
  for (const simd::KeepCounts& row : counts) {
    report.num_invalid += row.num_invalid;
    report.num_out_of_range += row.num_out_of_range;
    report.num_masked += row.num_masked;
    report.num_edge += row.num_edge;
    report.num_slanted += row.num_slanted;
  }
  return keep;
}

// The reasons of keep_pixels, pixel by pixel; what went later was isolated.
MaskImage label(const DepthRef& depth, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                const ByteImage& marks, const ByteImage& keep, int num_threads) {
  const float min_depth = round_up(options.min_depth), max_depth = round_down(options.max_depth);
  const auto reason = [&](int u, int v, const float* direction_x) {
    const float z = depth(v, u);
    if (!is_measurement(z) || std::isnan(direction_x[u])) return PixelLabel::invalid;
    if (z < min_depth || z > max_depth) return PixelLabel::out_of_range;
    if (mask.size() > 0 && mask(v, u) == 0) return PixelLabel::masked;
    if ((marks.row(v)[u] & simd::edge_mark) != 0) return PixelLabel::edge;
    if ((marks.row(v)[u] & simd::slanted_mark) != 0) return PixelLabel::slanted;
    return keep.row(v)[u] != 0 ? PixelLabel::kept : PixelLabel::isolated;
  };
  MaskImage labels(depth.rows(), depth.cols());
  parallel_for(depth.rows(), rows_per_block(depth.cols()), num_threads, [&](std::int64_t row) {
    const int v = static_cast<int>(row);
    const float* const direction_x = camera.ray_table().row(v).x;
    for (int u = 0; u < camera.width(); ++u) labels(v, u) = static_cast<std::uint8_t>(reason(u, v, direction_x));
  });
  return labels;
}

}  // namespace

void DepthOptions::check() const {
  require(min_depth >= 0.0 && std::isfinite(min_depth), "min_depth", "a finite number of metres, at least 0",
          min_depth);
  require(max_depth > min_depth, "max_depth", "greater than min_depth", max_depth);
  require(gradient_threshold > 0.0, "gradient_threshold", "a positive depth step in metres", gradient_threshold);
  require(edge_dilation >= 0 && edge_dilation <= 100, "edge_dilation", "0 to 100 pixels", edge_dilation);
  require(edge_sigmas > 0.0, "edge_sigmas", "a positive number of standard deviations", edge_sigmas);
  require(planar_keep_sigmas >= 0.0, "planar_keep_sigmas", "a number of standard deviations, at least 0",
          planar_keep_sigmas);
  require(max_slant > 0.0 && max_slant < 1.5707963, "max_slant", "an angle between 0 and pi / 2", max_slant);
  require(max_missing >= 0.0 && max_missing <= 1.0, "max_missing", "a part between 0 and 1", max_missing);
  require(min_component >= 0, "min_component", "a number of pixels, at least 0", min_component);
  require(std::isfinite(tilt), "tilt", "a finite number", tilt);
  if (noise) noise->check();
}

namespace {

// A tilt is taken away first.
DepthImage clean_straight(const DepthRef& depth, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                          DepthReport* report, MaskImage* labels, int num_threads) {
  const auto clean = [&](const DepthRef& straight) {
    return clean_depth(straight, camera, options, mask, nullptr, report, labels, num_threads);
  };
  return options.tilt == 0.0 ? clean(depth) : clean(correct_depth(depth, camera, options.tilt, num_threads));
}

}  // namespace

DepthImage preprocess_depth(const DepthRef& depth, const Camera& camera, const DepthOptions& options,
                            const MaskRef& mask, DepthReport* report, int num_threads) {
  return clean_straight(depth, camera, options, mask, report, nullptr, num_threads);
}

DepthImage clean_depth(const DepthRef& measured, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                       NoiseCalibration* calibration, DepthReport* report, MaskImage* labels, int num_threads,
                       const MaskRef& scene) {
  options.check();
  require_camera_size("depth", measured.rows(), measured.cols(), camera);
  if (mask.size() > 0) require_camera_size("mask", mask.rows(), mask.cols(), camera);
  const RestoredDepth restored(measured, camera, num_threads);
  const DepthRef& depth = restored.image();
  require_plausible_median(depth);

  // The tests see every measurement, so that range and mask do not make edges where there are none.
  const PlanarImage image(depth, camera, num_threads);
  const WindowFits fits = fit_windows(image, camera, restored.unit(), num_threads);
  if (calibration != nullptr && !options.noise) {
    calibration->add(image, scene.size() > 0 ? fits_of(scene, fits) : fits, num_threads);
  }
  const NoiseModel noise = options.noise            ? *options.noise
                           : calibration != nullptr ? calibration->model()
                                                    : estimate_noise(fits, camera, num_threads);
  const ByteImage first_marks = mark_edges(depth, image, fits, noise, options, num_threads);
  ByteImage marks = dilated(first_marks, options.edge_dilation, num_threads);
  if (options.edge_test == EdgeTest::inverse_depth) {
    keep_planar(image, first_marks, noise, options, num_threads, marks);
  }

  DepthReport counts;
  ByteImage keep = keep_pixels(depth, camera, options, mask, marks, num_threads, counts);
  remove_isolated(options.max_missing, num_threads, keep);
  remove_speckles(image, noise, options, num_threads, keep);

  DepthImage clean(depth.rows(), depth.cols());
  const auto select_row = simd::select_kept();
  counts.num_kept = block_reduce(clean.rows(), rows_per_block(clean.cols()), num_threads, std::int64_t{0},
                                 [&](std::int64_t begin, std::int64_t end) {
                                   std::int64_t count = 0;
                                   for (std::int64_t v = begin; v < end; ++v) {
                                     count +=
                                         select_row(&depth.coeffRef(v, 0), keep.row(v), camera.width(), &clean(v, 0));
                                   }
                                   return count;
                                 });
  counts.num_pixels = counts.num_isolated = depth.size();
  for (const std::int64_t others : {counts.num_invalid, counts.num_out_of_range, counts.num_masked, counts.num_edge,
                                    counts.num_slanted, counts.num_kept}) {
    counts.num_isolated -= others;
  }
  if (report != nullptr) *report = counts;
  if (labels != nullptr) *labels = label(depth, camera, options, mask, marks, keep, num_threads);
  return clean;
}

MaskImage label_pixels(const DepthRef& depth, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                       int num_threads) {
  MaskImage labels;
  clean_straight(depth, camera, options, mask, nullptr, &labels, num_threads);
  return labels;
}

}  // namespace nacre
