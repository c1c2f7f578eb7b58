// Pairs of matched points, and their residuals.
#pragma once

#include <limits>

#include "base/numbers.hpp"
#include "nacre/registration.hpp"

namespace nacre {

// A source point p, already moved, and the target point q that it is matched with.
struct Pair {
  Eigen::Vector3d p, q;
  Eigen::Vector3d normal;           // direction along which the residual counts; not used by point_to_point
  Eigen::Vector3d half_difference;  // of the two points' normals; NaN where only one is known
  double weight;
  double agreement = 1.0;  // the part of the weight that says how well the two points match, at most 1
  double noise = std::numeric_limits<double>::quiet_NaN();  // of p: a standard deviation [m]
  double largest_residual = infinity<double>;               // that a match may have [m]
};

inline double residual(const Pair& pair, Metric metric) {
  const Eigen::Vector3d difference = pair.p - pair.q;
  return metric == Metric::point_to_point ? difference.norm() : difference.dot(pair.normal);
}

}  // namespace nacre
