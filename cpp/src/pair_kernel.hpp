// The inner loop of consolidation: sums over the points around one place, weighted by their distance. Written in a
// fixed number of lanes with the same expression in each, so that a compiler can use vectors of any width and every
// width gives the same bits.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

namespace nacre {

constexpr std::size_t pair_lanes = 8;

// Coordinates in separate arrays, with a mass each; readable for pair_lanes - 1 entries past the end.
struct PairPoints {
  const float* x;
  const float* y;
  const float* z;
  const float* mass;
};

// Up to nine ranges [begin, end) of points.
struct PairRuns {
  std::array<std::pair<std::size_t, std::size_t>, 9> ranges;
  std::size_t count = 0;

  auto begin() const { return ranges.begin(); }
  auto end() const { return ranges.begin() + count; }
};

// The weight of a pair at distance r: theta(r) = 2^(exponent r^2), divided by a power of r.
struct PairKernel {
  enum class Decay { none, distance, squared_distance };

  Decay decay;
  float exponent;
  float reach2;      // pairs at this squared distance or farther have no weight
  float softening2;  // decay::distance takes r as sqrt(r^2 + softening2)
  float skip2;       // pairs at this squared distance or nearer have no weight; -1: none is too near
};

// 2^x for x <= 0, clamped at 2^-126; relative error 1.3e-7.
inline float exp2_of_negative(float x) {
  constexpr float rounder = 12582912.0F;  // 1.5 * 2^23: a sum with it has no bits below 1
  const float clamped = x < -126.0F ? -126.0F : x;
  const float whole = (clamped + rounder) - rounder;
  const float f = clamped - whole;
  float power = 0.00132764736F;
  power = power * f + 0.00967554188F;
  power = power * f + 0.0555071327F;
  power = power * f + 0.240221197F;
  power = power * f + 0.693146967F;
  power = power * f + 1.0F;
  std::int32_t bits;
  std::memcpy(&bits, &power, sizeof bits);
  bits += static_cast<std::int32_t>(whole) << 23;
  std::memcpy(&power, &bits, sizeof power);
  return power;
}

template <PairKernel::Decay decay>
inline float pair_weight(const PairKernel& kernel, float squared_distance) {
  float weight = exp2_of_negative(kernel.exponent * squared_distance);
  if constexpr (decay == PairKernel::Decay::distance) weight /= std::sqrt(squared_distance + kernel.softening2);
  if constexpr (decay == PairKernel::Decay::squared_distance) weight /= squared_distance;
  const bool counts = (squared_distance < kernel.reach2) & (squared_distance > kernel.skip2);
  return counts ? weight : 0.0F;
}

inline float pair_weight(const PairKernel& kernel, float squared_distance) {
  switch (kernel.decay) {
    case PairKernel::Decay::none:
      return pair_weight<PairKernel::Decay::none>(kernel, squared_distance);
    case PairKernel::Decay::distance:
      return pair_weight<PairKernel::Decay::distance>(kernel, squared_distance);
    default:
      return pair_weight<PairKernel::Decay::squared_distance>(kernel, squared_distance);
  }
}

// Sums over pairs, d being the offset from the place to the point, w the pair's weight times the point's mass.
struct PairSums {
  float mass;              // of w
  Eigen::Vector3f first;   // of w d
  Eigen::Matrix3f second;  // of w d d^T
};

// moments says how far the sums go: 0 mass only, 1 also first, 2 all; the others are not set.
template <int moments, PairKernel::Decay decay>
PairSums sum_pairs(const PairKernel& kernel_ref, const PairPoints& points, const PairRuns& runs,
                   const Eigen::Vector3f& place) {
  constexpr std::size_t num_sums = moments == 0 ? 1 : moments == 1 ? 4 : 10;
  float lanes[num_sums][pair_lanes] = {};
  const PairKernel kernel = kernel_ref;
  const float x = place.x(), y = place.y(), z = place.z();
  for (const auto& [begin, end] : runs) {
    for (std::size_t start = begin; start < end; start += pair_lanes) {
      const int remaining = static_cast<int>(std::min(end - start, pair_lanes));
      for (std::size_t lane = 0; lane < pair_lanes; ++lane) {
        const float dx = points.x[start + lane] - x;
        const float dy = points.y[start + lane] - y;
        const float dz = points.z[start + lane] - z;
        const float weight = pair_weight<decay>(kernel, dx * dx + dy * dy + dz * dz) * points.mass[start + lane];
        const float w = static_cast<int>(lane) < remaining ? weight : 0.0F;
        lanes[0][lane] += w;
        if constexpr (moments >= 1) {
          lanes[1][lane] += w * dx;
          lanes[2][lane] += w * dy;
          lanes[3][lane] += w * dz;
        }
        if constexpr (moments >= 2) {
          lanes[4][lane] += w * dx * dx;
          lanes[5][lane] += w * dx * dy;
          lanes[6][lane] += w * dx * dz;
          lanes[7][lane] += w * dy * dy;
          lanes[8][lane] += w * dy * dz;
          lanes[9][lane] += w * dz * dz;
        }
      }
    }
  }

  float total[num_sums];
  for (std::size_t sum = 0; sum < num_sums; ++sum) {
    for (std::size_t width = pair_lanes / 2; width > 0; width /= 2) {
      for (std::size_t lane = 0; lane < width; ++lane) lanes[sum][lane] += lanes[sum][lane + width];
    }
    total[sum] = lanes[sum][0];
  }
  PairSums sums;
  sums.mass = total[0];
  if constexpr (moments >= 1) sums.first << total[1], total[2], total[3];
  if constexpr (moments >= 2) {
    sums.second << total[4], total[5], total[6],  //
        total[5], total[7], total[8],             //
        total[6], total[8], total[9];
  }
  return sums;
}

template <int moments>
PairSums sum_pairs(const PairKernel& kernel, const PairPoints& points, const PairRuns& runs,
                   const Eigen::Vector3f& place) {
  switch (kernel.decay) {
    case PairKernel::Decay::none:
      return sum_pairs<moments, PairKernel::Decay::none>(kernel, points, runs, place);
    case PairKernel::Decay::distance:
      return sum_pairs<moments, PairKernel::Decay::distance>(kernel, points, runs, place);
    default:
      return sum_pairs<moments, PairKernel::Decay::squared_distance>(kernel, points, runs, place);
  }
}

}  // namespace nacre
