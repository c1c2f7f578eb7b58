#include "nacre/depth.hpp"

#include <algorithm>
#include <cmath>

#include "check.hpp"
#include "depth_cleaning.hpp"
#include "parallel.hpp"
#include "planar_image.hpp"

namespace nacre {
namespace {

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

// A pixel beyond the end of the distortion model sees nothing that could be placed.
bool has_direction(const Ray& ray) { return ray.direction_x == ray.direction_x; }

// A wrong depth_scale shows as a median depth that no depth camera measures. A sample of the pixels tells enough.
void require_plausible_median(const DepthRef& depth) {
  constexpr std::int64_t max_sample = 1 << 15;
  const std::int64_t stride = std::max<std::int64_t>(1, depth.size() / max_sample);
  std::vector<float> sample;
  sample.reserve(static_cast<std::size_t>(depth.size() / stride + 1));
  for (std::int64_t i = 0; i < depth.size(); i += stride) {
    const float z = depth(i / depth.cols(), i % depth.cols());
    if (is_measurement(z)) sample.push_back(z);
  }
  if (sample.empty()) return;
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  if (*middle >= 0.05F && *middle <= 50.0F) return;
  std::ostringstream message;
  message << "depth must be in metres with a median of 0.05 to 50 m, got a median of " << *middle
          << " m: check depth_scale, the stored units per metre (1000 for millimetres, 5000 for TUM RGB-D)";
  throw std::invalid_argument(message.str());
}

EdgeMarks mark_edges(const DepthRef& depth, const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                     const DepthOptions& options, int num_threads) {
  switch (options.edge_test) {
    case EdgeTest::gradient:
      return mark_gradient_edges(depth, options, num_threads);
    case EdgeTest::inverse_depth:
      return mark_planar_edges(image, fits, noise, options, num_threads);
    case EdgeTest::none:
      break;
  }
  const auto size = static_cast<std::size_t>(depth.size());
  return {Marks(size), Marks(size)};
}

}  // namespace

void DepthOptions::check() const {
  require(min_depth >= 0.0 && std::isfinite(min_depth), "min_depth", "a finite number of metres, at least 0",
          min_depth);
  require(max_depth > min_depth, "max_depth", "greater than min_depth", max_depth);
  require(gradient_threshold > 0.0, "gradient_threshold", "a positive depth step in metres", gradient_threshold);
  require(edge_dilation >= 0 && edge_dilation <= 100, "edge_dilation", "0 to 100 pixels", edge_dilation);
  require(edge_sigmas > 0.0, "edge_sigmas", "a positive number of standard deviations", edge_sigmas);
  require(max_slant > 0.0 && max_slant < 1.5707963, "max_slant", "an angle between 0 and pi / 2", max_slant);
  require(max_missing >= 0.0 && max_missing <= 1.0, "max_missing", "a part between 0 and 1", max_missing);
  require(min_component >= 0, "min_component", "a number of pixels, at least 0", min_component);
  if (noise) noise->check();
}

void NoiseModel::check() const {
  require(std::isfinite(constant) && constant >= 0.0, "noise.constant", "a finite number of metres, at least 0",
          constant);
  require(std::isfinite(quadratic) && quadratic >= 0.0, "noise.quadratic", "finite, at least 0", quadratic);
  require(std::isfinite(offset), "noise.offset", "finite", offset);
}

DepthImage depth_from_raw(
    const Eigen::Ref<const Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& raw,
    double depth_scale) {
  require(std::isfinite(depth_scale) && depth_scale > 0.0, "depth_scale", "a positive number of stored units per metre",
          depth_scale);
  const auto scale = static_cast<float>(depth_scale);
  return raw.unaryExpr([scale](std::uint16_t value) {
    return value == 0 || value == 65535 ? kMissing : static_cast<float>(value) / scale;
  });
}

DepthImage preprocess_depth(const DepthRef& depth, const Camera& camera, const DepthOptions& options,
                            const MaskRef& mask, DepthReport* report, int num_threads) {
  options.check();
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  if (mask.size() > 0) require_camera_size("mask", mask.rows(), mask.cols(), camera);
  require_plausible_median(depth);

  // The tests see every measurement, so that range and mask do not make edges where there are none.
  const PlanarImage image(depth, camera, num_threads);
  const WindowFits fits = fit_windows(image, num_threads);
  const NoiseModel noise = options.noise ? *options.noise : estimate_noise(image, fits, camera);
  EdgeMarks marks = mark_edges(depth, image, fits, noise, options, num_threads);
  const int width = camera.width(), height = camera.height();
  dilate(width, height, options.edge_dilation, num_threads, marks.edge);
  dilate(width, height, options.edge_dilation, num_threads, marks.slanted);

  const Ray* const rays = camera.rays().data();
  DepthReport counts;
  counts.num_pixels = depth.size();
  Marks keep(static_cast<std::size_t>(depth.size()));
  for (std::int64_t v = 0, i = 0; v < height; ++v) {
    for (std::int64_t u = 0; u < width; ++u, ++i) {
      const float z = depth(v, u);
      const auto pixel = static_cast<std::size_t>(i);
      if (!is_measurement(z) || !has_direction(rays[i])) {
        ++counts.num_invalid;
      } else if (z < options.min_depth || z > options.max_depth) {
        ++counts.num_out_of_range;
      } else if (mask.size() > 0 && mask(v, u) == 0) {
        ++counts.num_masked;
      } else if (marks.edge[pixel]) {
        ++counts.num_edge;
      } else if (marks.slanted[pixel]) {
        ++counts.num_slanted;
      } else {
        keep[pixel] = 1;
      }
    }
  }
  const auto drop = [&](const Marks& isolated) {
    for (std::size_t i = 0; i < keep.size(); ++i) {
      counts.num_isolated += isolated[i];
      keep[i] = keep[i] & !isolated[i];
    }
  };
  drop(mark_lonely(width, height, keep, options.max_missing, num_threads));
  drop(mark_specks(image, noise, options, keep));

  DepthImage clean(height, width);
  for (std::int64_t i = 0; i < clean.size(); ++i) {
    const bool kept = keep[static_cast<std::size_t>(i)] != 0;
    counts.num_kept += kept;
    clean.data()[i] = kept ? depth(i / width, i % width) : kMissing;
  }
  if (report != nullptr) *report = counts;
  return clean;
}

Points back_project(const DepthRef& depth, const Camera& camera) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  const Ray* const rays = camera.rays().data();
  const auto seen = [&](Eigen::Index v, Eigen::Index u) {
    return is_measurement(depth(v, u)) && has_direction(rays[v * depth.cols() + u]);
  };
  Eigen::Index num_points = 0;
  for (Eigen::Index v = 0; v < depth.rows(); ++v) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) num_points += seen(v, u);
  }
  Points points(num_points, 3);
  Eigen::Index next = 0;
  for (Eigen::Index v = 0; v < depth.rows(); ++v) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      if (!seen(v, u)) continue;
      const Ray& ray = rays[v * depth.cols() + u];
      const float z = depth(v, u);
      points.row(next++) << ray.origin_x + z * ray.direction_x, ray.origin_y + z * ray.direction_y, z * ray.direction_z;
    }
  }
  return points;
}

}  // namespace nacre
