#include "depth/gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/limits.hpp"
#include "base/statistics.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"
#include "depth/window_fits.hpp"

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

// Whether what a pixel inside the image measures lies on no surface with any of the eight around it, and farther from
// these than they scatter: it is taken for no measurement.
bool is_lone(const DepthRef& depth, Eigen::Index v, Eigen::Index u, const OneSurface& one_surface) {
  const float z = depth(v, u);
  if (!is_measurement(z) || one_surface(z, depth(v, u - 1))) return false;
  std::array<float, 8> around{};
  std::size_t count = 0;
  for (Eigen::Index row = v - 1; row <= v + 1; ++row) {
    for (Eigen::Index col = u - 1; col <= u + 1; ++col) {
      const float other = depth(row, col);
      if ((row == v && col == u) || !is_measurement(other)) continue;
      if (one_surface(z, other)) return false;
      around[count++] = other;
    }
  }
  if (2 * count <= around.size()) return false;
  const auto median_of_them = [&] {
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(around.begin(), middle, around.begin() + static_cast<std::ptrdiff_t>(count));
    return *middle;
  };
  const float median = median_of_them();
  for (float& other : around) other = std::abs(other - median);
  const auto scatter = static_cast<float>(mad_to_sigma) * median_of_them();
  return std::abs(z - median) > base_limits::noise_sigmas * scatter;
}

DepthImage without_lone_pixels(const DepthRef& depth, const OneSurface& one_surface) {
  DepthImage result = depth;
  for (Eigen::Index v = 1; v + 1 < depth.rows(); ++v) {
    for (Eigen::Index u = 1; u + 1 < depth.cols(); ++u) {
      if (is_lone(depth, v, u, one_surface)) result(v, u) = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return result;
}

}  // namespace

bool has_gaps(const DepthRef& depth, const Camera& camera) {
  const OneSurface one_surface(camera);
  std::int64_t num_measured = 0, num_gaps = 0;
  for (Eigen::Index v = 1; v + 1 < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 1; u + 1 < depth.cols(); ++u) {
      if (is_measurement(depth(v, u)) && !is_lone(depth, v, u, one_surface)) {
        ++num_measured;
      } else if (one_surface(depth(v, u - 1), depth(v, u + 1)) || one_surface(depth(v - 1, u), depth(v + 1, u))) {
        ++num_gaps;
      }
    }
  }
  const std::int64_t side = 2 * WindowFits::kRadius + 1;
  return num_gaps >= depth_limits::least_witnesses && side * side * num_gaps > num_measured;
}

DepthImage fill_gaps(const DepthRef& measured, const Camera& camera) {
  const OneSurface one_surface(camera);
  const DepthImage depth = without_lone_pixels(measured, one_surface);
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
