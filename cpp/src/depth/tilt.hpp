// A tilt of the inverse depth, taken away from points that were made of it.
#pragma once

#include "depth/limits.hpp"
#include "nacre/types.hpp"

namespace nacre {

struct SurfacePoint {
  Eigen::Vector3f point, normal;  // camera frame
};

// The point goes along its ray: 1 / z less tilt * x / z. Of a plane n . p = d, with d = n . p the equation of its
// inverse depth, n . ray = d / z, becomes (n - tilt d e_x) . ray = d / z.
inline SurfacePoint without_tilt(const SurfacePoint& seen, double tilt) {
  const float change = static_cast<float>(tilt) * seen.point.x();
  if (!(std::abs(change) < depth_limits::largest_correction)) return seen;
  Eigen::Vector3f normal = seen.normal;
  normal.x() -= static_cast<float>(tilt) * seen.normal.dot(seen.point);
  return {seen.point / (1.0F - change), normal.normalized()};
}

}  // namespace nacre
