// The inner loop of consolidation: sums over the points around one place, weighted by their distance. Written in a
// fixed number of lanes with one expression a lane, so that a compiler can use vectors of any width and every width
// gives the same bits.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace nacre {

constexpr int pair_lanes = 8;

// Coordinates in separate arrays with a mass each, readable for pair_lanes - 1 entries past the end.
struct PairPoints {
  const float* x;
  const float* y;
  const float* z;
  const float* mass;
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

// Sums of w, w d and w d d^T over pairs, d being the offset from the place to the point, w the pair's weight times the
// point's mass; moments says up to which of the three.
template <int moments>
class PairSums {
  static constexpr int num_sums = moments == 0 ? 1 : moments == 1 ? 4 : 10;

 public:
  void add(const PairKernel& kernel, const PairPoints& points, std::int64_t begin, std::int64_t end,
           const Eigen::Vector3f& place) {
    switch (kernel.decay) {
      case PairKernel::Decay::none:
        return add<PairKernel::Decay::none>(kernel, points, begin, end, place);
      case PairKernel::Decay::distance:
        return add<PairKernel::Decay::distance>(kernel, points, begin, end, place);
      case PairKernel::Decay::squared_distance:
        return add<PairKernel::Decay::squared_distance>(kernel, points, begin, end, place);
    }
  }

  float mass() const { return total(0); }
  Eigen::Vector3f first() const { return {total(1), total(2), total(3)}; }
  Eigen::Matrix3f second() const {
    Eigen::Matrix3f sums;
    sums << total(4), total(5), total(6),  //
        total(5), total(7), total(8),      //
        total(6), total(8), total(9);
    return sums;
  }

 private:
  using Lanes = std::array<float, pair_lanes>;

  template <PairKernel::Decay decay>
  void add(const PairKernel& kernel_ref, const PairPoints& points, std::int64_t begin, std::int64_t end,
           const Eigen::Vector3f& place) {
    const PairKernel kernel = kernel_ref;
    const float x = place.x(), y = place.y(), z = place.z();
    std::array<Lanes, num_sums> sums = sums_;
    for (std::int64_t start = begin; start < end; start += pair_lanes) {
      const int remaining = static_cast<int>(std::min<std::int64_t>(end - start, pair_lanes));
      for (int lane = 0; lane < pair_lanes; ++lane) {
        const auto l = static_cast<std::size_t>(lane);
        const float dx = points.x[start + lane] - x;
        const float dy = points.y[start + lane] - y;
        const float dz = points.z[start + lane] - z;
        const float weight = pair_weight<decay>(kernel, dx * dx + dy * dy + dz * dz) * points.mass[start + lane];
        const float w = lane < remaining ? weight : 0.0F;
        sums[0][l] += w;
        if constexpr (moments >= 1) {
          sums[1][l] += w * dx;
          sums[2][l] += w * dy;
          sums[3][l] += w * dz;
        }
        if constexpr (moments >= 2) {
          sums[4][l] += w * dx * dx;
          sums[5][l] += w * dx * dy;
          sums[6][l] += w * dx * dz;
          sums[7][l] += w * dy * dy;
          sums[8][l] += w * dy * dz;
          sums[9][l] += w * dz * dz;
        }
      }
    }
    sums_ = sums;
  }

  float total(std::size_t which) const {
    Lanes lanes = sums_[which];
    for (std::size_t width = pair_lanes / 2; width > 0; width /= 2) {
      for (std::size_t lane = 0; lane < width; ++lane) lanes[lane] += lanes[lane + width];
    }
    return lanes[0];
  }

  std::array<Lanes, num_sums> sums_{};
};

}  // namespace nacre
