#include "depth/saturation.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"

namespace nacre {
namespace {

template <class Visit>
void for_each_probed(const DepthRef& depth, Visit&& visit) {
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) visit(depth(v, u));
  }
}

bool is_saturated(float largest, const DepthRef& depth) {
  std::vector<float> levels;  // some of the rest
  const float near = (1.0F - depth_limits::saturation_gap) * largest, far = largest / depth_limits::far_saturation;
  std::int64_t num_probed = 0, num_largest = 0, num_near = 0, num_between = 0, num_nearer = 0;
  for_each_probed(depth, [&](float z) {
    const bool is_other = is_measurement(z) && z < largest;
    ++num_probed;
    num_largest += z == largest;
    num_near += is_other && z > near;
    num_between += is_other && z > far;
    num_nearer += is_other && z <= far;
    const bool asks = is_other && static_cast<std::int64_t>(levels.size()) < depth_limits::least_levels;
    if (asks && std::find(levels.begin(), levels.end(), z) == levels.end()) levels.push_back(z);
  });
  return num_largest >= depth_limits::fewest_saturated &&
         static_cast<double>(num_largest) >= depth_limits::least_saturated * static_cast<double>(num_probed) &&
         static_cast<std::int64_t>(levels.size()) == depth_limits::least_levels && num_near <= num_largest &&
         num_between < num_nearer;
}

}  // namespace

DepthImage without_saturated(const DepthRef& depth) {
  float largest = 0.0F;
  for_each_probed(depth, [&](float z) { largest = is_measurement(z) ? std::max(largest, z) : largest; });
  if (!is_saturated(largest, depth)) return {};
  return (depth < largest).select(depth, std::numeric_limits<float>::quiet_NaN());
}

}  // namespace nacre
