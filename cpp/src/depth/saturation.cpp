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

// The largest measurement, and how many of the probed pixels have it.
struct Largest {
  float value = 0.0F;
  std::int64_t count = 0, num_probed = 0;
};

Largest largest_of(const DepthRef& depth) {
  Largest largest;
  for_each_probed(depth, [&](float z) {
    ++largest.num_probed;
    largest.count += z == largest.value;
    if (z > largest.value && is_measurement(z)) {
      largest.value = z;
      largest.count = 1;
    }
  });
  return largest;
}

bool is_saturated(const Largest& largest, const DepthRef& depth) {
  const double least = depth_limits::least_saturated * static_cast<double>(largest.num_probed);
  if (largest.count < depth_limits::least_witnesses || static_cast<double>(largest.count) < least) return false;
  std::vector<float> levels;  // some of the rest
  const float near = (1.0F - depth_limits::saturation_gap) * largest.value;
  const float far = largest.value / depth_limits::far_saturation;
  std::int64_t num_near = 0, num_between = 0, num_nearer = 0;
  for_each_probed(depth, [&](float z) {
    if (!is_measurement(z) || !(z < largest.value)) return;
    num_near += z > near;
    num_between += z > far;
    num_nearer += z <= far;
    const bool asks = static_cast<std::int64_t>(levels.size()) < depth_limits::least_levels;
    if (asks && std::find(levels.begin(), levels.end(), z) == levels.end()) levels.push_back(z);
  });
  return static_cast<std::int64_t>(levels.size()) == depth_limits::least_levels && num_near <= largest.count &&
         num_between < num_nearer;
}

}  // namespace

DepthImage without_saturated(const DepthRef& depth) {
  const Largest largest = largest_of(depth);
  if (!is_saturated(largest, depth)) return {};
  return (depth < largest.value).select(depth, std::numeric_limits<float>::quiet_NaN());
}

}  // namespace nacre
