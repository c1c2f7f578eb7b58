#include "depth/gaps.hpp"

#include <cmath>

#include "base/limits.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"

namespace nacre {
namespace {

// Surfaces that are not too steep do not step farther from one side of a gap to the other.
class OneSurface {
 public:
  explicit OneSurface(const Camera& camera) : camera_(camera), is_pinhole_(camera.model() == Camera::Model::pinhole) {}

  bool operator()(float a, float b) const {
    if (!is_measurement(a) || !is_measurement(b)) return false;
    return std::abs(a - b) <= 2.0F * depth_limits::gate_slope * static_cast<float>(camera_.footprint(std::min(a, b)));
  }
  float between(float a, float b) const { return is_pinhole_ ? 2.0F * a * b / (a + b) : 0.5F * (a + b); }

 private:
  const Camera& camera_;
  bool is_pinhole_;
};

// Clusters of pixels that are measured with a lower probability than this are finite: site percolation.
bool is_scattered(const DepthRef& depth) {
  std::int64_t num_measured = 0, num_neighbours = 0;
  for (Eigen::Index v = 0; v + 1 < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u + 1 < depth.cols(); ++u) {
      if (!is_measurement(depth(v, u))) continue;
      ++num_measured;
      num_neighbours += is_measurement(depth(v, u + 1)) + is_measurement(depth(v + 1, u));
    }
  }
  const double expected = 2.0 * depth_limits::percolation * static_cast<double>(num_measured);
  const double sigma = std::sqrt(expected * (1.0 - depth_limits::percolation));
  return static_cast<double>(num_neighbours) < expected - base_limits::noise_sigmas * sigma;
}

bool has_cracks(const DepthRef& depth, const Camera& camera) {
  const OneSurface one_surface(camera);
  // The middle of five missing pixels in a line, with the same surface on both sides of it.
  const auto is_crack = [&](Eigen::Index v, Eigen::Index u, Eigen::Index down, Eigen::Index right) {
    for (const Eigen::Index step : {-2, -1, 0, 1, 2}) {
      if (is_measurement(depth(v + step * down, u + step * right))) return false;
    }
    return one_surface(depth(v - right, u - down), depth(v + right, u + down));
  };
  std::int64_t num_measured = 0, num_cracks = 0;
  for (Eigen::Index v = 2; v + 2 < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 2; u + 2 < depth.cols(); ++u) {
      if (is_measurement(depth(v, u))) {
        ++num_measured;
      } else if (is_crack(v, u, 1, 0) || is_crack(v, u, 0, 1)) {
        ++num_cracks;
      }
    }
  }
  return static_cast<double>(num_cracks) > depth_limits::least_cracked * static_cast<double>(num_measured);
}

}  // namespace

bool has_gaps(const DepthRef& depth, const Camera& camera) { return is_scattered(depth) || has_cracks(depth, camera); }

DepthImage fill_gaps(const DepthRef& depth, const Camera& camera) {
  const OneSurface one_surface(camera);
  DepthImage rows = depth;
  for (Eigen::Index v = 0; v < depth.rows(); ++v) {
    for (Eigen::Index u = 1; u + 1 < depth.cols(); ++u) {
      const float left = depth(v, u - 1), right = depth(v, u + 1);
      if (!is_measurement(depth(v, u)) && one_surface(left, right)) rows(v, u) = one_surface.between(left, right);
    }
  }
  DepthImage filled = rows;
  for (Eigen::Index v = 1; v + 1 < depth.rows(); ++v) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const float above = rows(v - 1, u), below = rows(v + 1, u);
      if (!is_measurement(rows(v, u)) && one_surface(above, below)) filled(v, u) = one_surface.between(above, below);
    }
  }
  return filled;
}

}  // namespace nacre
