// Random numbers that neighbouring places share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/random.hpp"
#include "simulation/limits.hpp"

namespace nacre {

// Of one image, and of all images of a sensor.
struct Seeds {
  std::uint64_t image, sensor;
};

// A seed for each of several independent streams of random numbers.
inline std::uint64_t stream_of(std::uint64_t seed, std::uint64_t stream) {
  return random_bits(seed, (std::uint64_t{3} << 62) | stream);
}

// Standard normal at each place; places d apart correlate by about exp(-d^2): quadratic B-splines between the random
// numbers of the integers around, scaled to variance 1.
template <int dimensions>
double smooth_noise(std::uint64_t seed, const Eigen::Matrix<double, dimensions, 1>& place) {
  std::int64_t nearest[dimensions];
  double weights[dimensions][3];
  double sum_squares = 1.0;
  int count = 1;
  for (int k = 0; k < dimensions; ++k) {
    const double x = std::clamp(place[k], -simulation_limits::farthest_place, simulation_limits::farthest_place),
                 middle = std::round(x), t = x - middle;
    nearest[k] = static_cast<std::int64_t>(middle);
    weights[k][0] = 0.5 * (0.5 - t) * (0.5 - t);
    weights[k][1] = 0.75 - t * t;
    weights[k][2] = 0.5 * (0.5 + t) * (0.5 + t);
    sum_squares *= weights[k][0] * weights[k][0] + weights[k][1] * weights[k][1] + weights[k][2] * weights[k][2];
    count *= 3;
  }
  double sum = 0.0;
  for (int node = 0; node < count; ++node) {
    double weight = 1.0;
    std::uint64_t counter = 0;
    for (int k = 0, rest = node; k < dimensions; ++k, rest /= 3) {
      weight *= weights[k][rest % 3];
      counter = mix64(counter ^ static_cast<std::uint64_t>(nearest[k] + rest % 3 - 1));
    }
    sum += weight * random_normal(seed, counter);
  }
  return sum / std::sqrt(sum_squares);
}

// Smooth noise with a part of its variance that is the same in all images of a sensor.
inline double partly_fixed(const Seeds& seeds, std::uint64_t stream, double part, const Eigen::Vector2d& place) {
  return std::sqrt(1.0 - part) * smooth_noise<2>(stream_of(seeds.image, stream), place) +
         std::sqrt(part) * smooth_noise<2>(stream_of(seeds.sensor, stream), place);
}

}  // namespace nacre
