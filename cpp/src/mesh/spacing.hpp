// How far apart points are.
#pragma once

#include <cmath>

#include "mesh/limits.hpp"

namespace nacre {

// The mean distance of a point's nearest neighbours, from their squared distances: the first is its own.
inline double spacing_around(const double* squared) {
  double sum = 0.0;
  for (int n = 1; n <= mesh_limits::spacing_neighbors; ++n) sum += std::sqrt(squared[n]);
  return sum / mesh_limits::spacing_neighbors;
}

}  // namespace nacre
