// Which points of the model a frame may observe.
#pragma once

#include <cmath>

#include "camera/point_projection.hpp"
#include "fusion/limits.hpp"
#include "fusion/observer.hpp"

namespace nacre {

// The noise of a pixel [m]; 0 where nothing was measured.
inline float sigma_at(const Frame& frame, std::int32_t pixel) {
  const float sigma = frame.sigma[pixel];
  return std::isfinite(sigma) ? sigma : 0.0F;
}

// Whether the frame may show a point of a block.
inline bool is_observable(const PointProjection::Block& points, int j, const Frame& frame,
                          const SurfaceObserver& observer) {
  if (!points.inside[j] || !(points.facing[j] > fusion_limits::least_facing)) return false;
  const float sigma = sigma_at(frame, points.pixel[j]);
  return observer.may_observe(points.point(j), points.pixel[j], sigma,
                              fusion_limits::least_weight * observer.frontal_weight(sigma));
}

}  // namespace nacre
