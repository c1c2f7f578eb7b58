// Which points are one.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "base/limits.hpp"

namespace nacre {

// Whether a point with a normal stands for the same piece of surface as another.
inline bool same_surface(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, const Eigen::Vector3f& other,
                         const Eigen::Vector3f& other_normal, float spacing, float largest_offset) {
  const Eigen::Vector3f difference = other - point;
  const float along = difference.dot(normal);
  return std::abs(along) < largest_offset && difference.squaredNorm() - along * along < spacing * spacing &&
         normal.dot(other_normal) > base_limits::same_side_cosine;
}

}  // namespace nacre
