// Points and normals of a depth image: each normal is one linear fit over a window of the planar image.
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "camera/ray_table.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"
#include "depth/window_fits.hpp"
#include "simd/depth_normals.hpp"
#include "simd/depth_points.hpp"

namespace nacre {
namespace {

simd::NormalRule normal_rule(const PlanarImage& image, const Camera& camera, const NoiseModel& noise) {
  const Quadratic sigma = image.sigma(noise.local()), unit_slope = image.unit_slope();
  return {sigma,
          unit_slope,
          sigma * (base_limits::noise_sigmas * std::sqrt(2.0F)),
          unit_slope * depth_limits::gate_slope,
          depth_limits::slope_sigma,
          depth_limits::least_filled,
          depth_limits::least_spread,
          static_cast<float>(camera.fx()),
          static_cast<float>(camera.fy())};
}

// Moves the first counts[row] values of each row together.
void compact(const std::vector<int>& counts, std::size_t width, std::vector<std::int32_t>& values) {
  auto end = values.begin();
  for (std::size_t row = 0; row < counts.size(); ++row) {
    const auto start = values.begin() + static_cast<std::ptrdiff_t>(row * width);
    end = std::copy(start, start + counts[row], end);
  }
  values.erase(end, values.end());
}

NoiseModel noise_of(const std::optional<NoiseModel>& given, const PlanarImage& image, const Camera& camera,
                    int num_threads) {
  if (!given) return estimate_noise(fit_windows(image, camera, {}, num_threads), camera, num_threads);
  given->check();
  return *given;
}

}  // namespace

Frame make_frame(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise, int num_threads) {
  Frame frame;
  make_frame(depth, camera, noise, num_threads, frame);
  return frame;
}

void make_frame(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise, int num_threads,
                Frame& frame) {
  const PlanarImage image(depth, camera, num_threads);
  const NoiseModel model = noise_of(noise, image, camera, num_threads);
  const simd::NormalRule rule = normal_rule(image, camera, model);
  const int width = camera.width(), height = camera.height();
  const Eigen::Index size = depth.size();
  frame.width = width;
  frame.height = height;
  frame.points.resize(size, 3);
  frame.normals.resize(size, 3);
  frame.sigma.resize(size);
  frame.valid.resize(static_cast<std::size_t>(size));
  std::vector<int> num_valid(static_cast<std::size_t>(height));
  const simd::SigmaCurve curve = {static_cast<float>(model.constant), static_cast<float>(model.quadratic),
                                  static_cast<float>(model.offset)};
  const auto fill_points = simd::fill_point_row();
  const auto fit_normals = simd::fit_normals();
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t row) {
    const int v = static_cast<int>(row);
    const std::int64_t first = row * width;
    const simd::RayRow rays = camera.ray_table().row(v);
    fill_points(&depth.coeffRef(row, 0), rays, curve, width, frame.points.data() + 3 * first,
                frame.sigma.data() + first);
    num_valid[static_cast<std::size_t>(row)] =
        fit_normals(image.planar_row(v), rule, rays, frame.normals.data() + 3 * first, static_cast<std::int32_t>(first),
                    frame.valid.data() + first);
  });
  compact(num_valid, static_cast<std::size_t>(width), frame.valid);
}

Points depth_normals(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise,
                     int num_threads) {
  const PlanarImage image(depth, camera, num_threads);
  const simd::NormalRule rule = normal_rule(image, camera, noise_of(noise, image, camera, num_threads));
  Points normals(depth.size(), 3);
  const auto fit_normals = simd::fit_normals();
  parallel_for(camera.height(), rows_per_block(camera.width()), num_threads, [&](std::int64_t row) {
    const int v = static_cast<int>(row);
    fit_normals(image.planar_row(v), rule, camera.ray_table().row(v), normals.data() + 3 * row * camera.width(), 0,
                nullptr);
  });
  return normals;
}

}  // namespace nacre
