// How bright surfaces are.
#pragma once

#include <cmath>

#include "simulation/limits.hpp"
#include "simulation/smooth_noise.hpp"

namespace nacre {

// Of a point of the world, the same from every side: smooth patches, lognormal about 1.
inline double reflectance(const Eigen::Vector3d& point) {
  return std::exp(simulation_limits::contrast *
                  smooth_noise<3>(stream_of(0, 0), Eigen::Vector3d(point / simulation_limits::patch_size)));
}

}  // namespace nacre
