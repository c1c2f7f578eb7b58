// Which points of the model a frame may observe.
#pragma once

#include <cmath>

#include "camera/point_projection.hpp"
#include "fusion/observer.hpp"

namespace nacre {

// In frontal measurements of a point's own noise: far surfaces are measured with less weight, not less often.
constexpr float least_weight = 0.05F;  // less observation than this is none

// The noise of a pixel [m]; 0 where nothing was measured.
inline float sigma_at(const Frame& frame, std::int32_t pixel) {
  const float sigma = frame.sigma[pixel];
  return std::isfinite(sigma) ? sigma : 0.0F;
}

// Whether the frame may show a point of a block.
inline bool is_observable(const PointProjection::Block& points, int j, const Frame& frame,
                          const SurfaceObserver& observer) {
  if (!points.inside[j] || !(points.facing[j] > least_facing)) return false;
  const float sigma = sigma_at(frame, points.pixel[j]);
  return observer.may_observe(points.point(j), points.pixel[j], sigma, least_weight * observer.frontal_weight(sigma));
}

}  // namespace nacre
