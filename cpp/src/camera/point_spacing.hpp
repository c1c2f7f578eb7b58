// How far apart the points of a model are where a camera sees them.
#pragma once

#include <algorithm>

#include "base/limits.hpp"
#include "camera/limits.hpp"
#include "nacre/camera.hpp"

namespace nacre {

// Between neighbours on a surface at a depth, measured with a noise [m]: the model's spacing, but never finer than what
// the frame tells apart, across the image or in depth.
inline float spacing_at(float z, float sigma, const Camera& camera, double spacing) {
  const double pixels = std::max(1.0, camera_limits::least_point_pixels / camera.binning());
  return static_cast<float>(std::max({spacing, pixels * camera.footprint(z), static_cast<double>(sigma)}));
}

// How far off a surface may be what is measured of it: as far as noise, and the shape between points that are so far
// apart, take it [m].
inline double largest_offset(double apart, float sigma) {
  return std::max(camera_limits::surface_spacings * apart, base_limits::noise_sigmas * static_cast<double>(sigma));
}

}  // namespace nacre
