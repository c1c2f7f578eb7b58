#include "depth/saturation.hpp"

#include <cstddef>
#include <limits>
#include <vector>

#include "base/statistics.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"

namespace nacre {
namespace {

float largest_measurement(const DepthRef& depth) {
  float largest = 0.0F;
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const float z = depth(v, u);
      if (is_measurement(z) && z > largest) largest = z;
    }
  }
  return largest;
}

bool is_saturated(float largest, const DepthRef& depth) {
  const float near = (1.0F - depth_limits::saturation_gap) * largest;
  std::size_t num_probed = 0, num_largest = 0, num_near = 0;
  std::vector<float> others;
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const float z = depth(v, u);
      ++num_probed;
      if (z == largest) {
        ++num_largest;
      } else if (is_measurement(z)) {
        others.push_back(z);
        num_near += z > near;
      }
    }
  }
  if (static_cast<double>(num_largest) < depth_limits::least_saturated * static_cast<double>(num_probed)) return false;
  if (others.empty() || num_near > num_largest) return false;
  return largest >= depth_limits::far_saturation * median_of(std::move(others));
}

}  // namespace

DepthImage without_saturated(const DepthRef& depth) {
  const float largest = largest_measurement(depth);
  if (!is_saturated(largest, depth)) return {};
  return (depth < largest).select(depth, std::numeric_limits<float>::quiet_NaN());
}

}  // namespace nacre
