// Rotations spread evenly over all.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace nacre {

// The i-th of `count` unit quaternions on a super-Fibonacci spiral (Alexa 2022, algorithm 1).
inline Eigen::Quaterniond spread_rotation(int i, int count) {
  constexpr double phi = 1.4142135623730951, psi = 1.533751168755204288118041, two_pi = 6.283185307179586;
  const double s = i + 0.5, r = std::sqrt(s / count), big_r = std::sqrt(1.0 - s / count);
  const double alpha = two_pi * s / phi, beta = two_pi * s / psi;
  return {big_r * std::cos(beta), r * std::sin(alpha), r * std::cos(alpha), big_r * std::sin(beta)};
}

}  // namespace nacre
