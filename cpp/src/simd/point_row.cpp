// Plain loops, bound by memory.
#include "point_row.hpp"

#include <float.h>

#include "vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

NACRE_INLINE bool is_measurement(float z) { return (z > 0.0F) & (z <= FLT_MAX); }

}  // namespace

void fill_planar_row(const float* depth, const float* direction_z, bool is_inverse, int width, float* values) {
  for (int u = 0; u < width; ++u) {
    const float z = direction_z != nullptr ? depth[u] * direction_z[u] : depth[u];
    const float value = is_inverse ? 1.0F / z : z;
    values[u] = is_measurement(z) & is_measurement(value) ? value : NAN;
  }
}

int count_points(const float* depth, const RayRow& rays, int width) {
  const float* const direction = rays.x;
  int count = 0;
  for (int u = 0; u < width; ++u) count += is_measurement(depth[u]) & (direction[u] == direction[u]);
  return count;
}

void gather_points(const float* depth, const RayRow& rays, int width, float* points) {
  constexpr int chunk = 64;
  const RayRow r = rays;
  for (int begin = 0; begin < width; begin += chunk) {
    const int count = width - begin < chunk ? width - begin : chunk;
    float all[3 * chunk];
    for (int i = 0; i < count; ++i) {
      const int u = begin + i;
      const float z = depth[u];
      all[3 * i] = r.origin_x[u] + z * r.x[u];
      all[3 * i + 1] = r.origin_y + z * (r.y != nullptr ? r.y[u] : r.row_y);
      all[3 * i + 2] = z * r.z[u];
    }
    int num_points = 0;
    if (count_points(depth + begin, {r.x + begin, nullptr, nullptr, 0.0F, nullptr, 0.0F, {}}, count) == count) {
      num_points = count;
    } else {
      for (int i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) all[3 * num_points + k] = all[3 * i + k];
        num_points += is_measurement(depth[begin + i]) & (r.x[begin + i] == r.x[begin + i]);
      }
    }
    memcpy(points, all, sizeof(float) * 3 * static_cast<size_t>(num_points));
    points += 3 * num_points;
  }
}

void fill_point_row(const float* depth, const RayRow& rays, const SigmaCurve& curve, int width, float* points,
                    float* sigma) {
  const RayRow r = rays;
  const SigmaCurve c = curve;
  for (int u = 0; u < width; ++u) {
    const float z = is_measurement(depth[u]) ? depth[u] : NAN;
    points[3 * u] = r.origin_x[u] + z * r.x[u];
    points[3 * u + 1] = r.origin_y + z * (r.y != nullptr ? r.y[u] : r.row_y);
    points[3 * u + 2] = z * r.z[u];
    sigma[u] = static_cast<float>(c.constant + c.quadratic * (z - c.offset) * (z - c.offset));
  }
}

}  // namespace nacre::simd::NACRE_ISA
