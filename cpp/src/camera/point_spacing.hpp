// How far apart the points of a model are where a camera sees them.
#pragma once

#include <algorithm>

#include "camera/limits.hpp"
#include "nacre/camera.hpp"

namespace nacre {

// Between neighbours on a surface at a depth, measured with a noise [m]: the model's spacing, but never finer than what
// the frame tells apart, across the image or in depth.
inline float spacing_at(float z, float sigma, const Camera& camera, double spacing) {
  const double pixels = std::max(1.0, camera_limits::least_point_pixels / camera.binning());
  return static_cast<float>(std::max({spacing, pixels * camera.footprint(z), static_cast<double>(sigma)}));
}

}  // namespace nacre
