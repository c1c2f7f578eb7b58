#include "model/checkpoint/surface_check.hpp"

#include <cmath>

#include "base/pose_check.hpp"

namespace nacre {

static bool is_unit(const Eigen::Vector3f& normal) { return std::abs(normal.squaredNorm() - 1.0F) < 0.01F; }

bool is_place(const Eigen::Vector3f& point) {
  return (point.array().abs() < static_cast<float>(4.0 * farthest_place)).all();  // of a camera, and, turned, from it
}

bool is_surface(const PointModel& cloud, std::size_t num_frames) {
  const std::size_t count = cloud.points.size();
  if (cloud.normals.size() != count || (!cloud.colors.empty() && cloud.colors.size() != count) ||
      cloud.confidence.size() != count || cloud.last_seen.size() != count || cloud.observations.size() != count ||
      cloud.free_space_violations.size() != count) {
    return false;
  }
  for (const PointAttribute& attribute : cloud.attributes) {
    if (attribute.num_channels < 1 || attribute.values.size() % static_cast<std::size_t>(attribute.num_channels) != 0 ||
        attribute.values.size() / static_cast<std::size_t>(attribute.num_channels) != count) {
      return false;
    }
  }
  const auto is_count = [](auto number) { return number >= 0 && std::isfinite(static_cast<float>(number)); };
  return are_all(cloud.points, is_place) && are_all(cloud.normals, is_unit) && are_all(cloud.confidence, is_count) &&
         are_all(cloud.observations, is_count) && are_all(cloud.free_space_violations, is_count) &&
         are_all(cloud.last_seen, [&](std::int32_t frame) { return is_within(frame, num_frames); });
}

}  // namespace nacre
