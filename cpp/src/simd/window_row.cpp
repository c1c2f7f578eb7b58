// Sums over the columns of all windows first, then over the columns of each: 30 operations a column and 60 a window, in
// doubles, of which the residual of a clean image is a small difference.
#include "window_row.hpp"

#include "vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int tile = 16;  // windows
constexpr int columns = fit_step * (tile - 1) + 2 * fit_radius + 1;

struct ColumnSums {
  double one[columns], v[columns], vv[columns], squares[columns];  // of the value times 1, v, v^2 - 4; of its square
};

NACRE_INLINE void sum_columns(const float* first, ptrdiff_t stride, int count, double origin, ColumnSums& sums) {
  for (int i = 0; i < count; ++i) {
    const float* const p = first + i;
    const double a = p[-3 * stride] - origin, b = p[-2 * stride] - origin, c = p[-stride] - origin;
    const double d = p[0] - origin;
    const double e = p[stride] - origin, f = p[2 * stride] - origin, g = p[3 * stride] - origin;
    sums.one[i] = ((a + g) + (b + f)) + ((c + e) + d);
    sums.v[i] = 3.0 * (g - a) + 2.0 * (f - b) + (e - c);
    sums.vv[i] = 5.0 * (a + g) - 3.0 * (c + e) - 4.0 * d;
    sums.squares[i] = ((a * a + g * g) + (b * b + f * f)) + ((c * c + e * e) + d * d);
  }
}

NACRE_INLINE double sum(const double* c) { return ((c[0] + c[6]) + (c[1] + c[5])) + ((c[2] + c[4]) + c[3]); }
NACRE_INLINE double sum_u(const double* c) { return 3.0 * (c[6] - c[0]) + 2.0 * (c[5] - c[1]) + (c[4] - c[2]); }

// Orthogonal polynomials on -3..3: 1, u, v, u v, u^2 - 4, v^2 - 4. The quadratic ones take up smooth curvature.
NACRE_INLINE void fit(const ColumnSums& sums, int count, float* residual, float* slope) {
  double left_over[tile], gradient[tile];
  for (int j = 0; j < count; ++j) {
    const int i = fit_step * j;
    const double* const one = sums.one + i;
    const double s = sum(one), u = sum_u(one), v = sum(sums.v + i), uv = sum_u(sums.v + i);
    const double uu = 5.0 * (one[0] + one[6]) - 3.0 * (one[2] + one[4]) - 4.0 * one[3], vv = sum(sums.vv + i);
    gradient[j] = u * u + v * v;
    left_over[j] = sum(sums.squares + i) - (s * s * (1.0 / 49) + gradient[j] * (1.0 / 196) + uv * uv * (1.0 / 784) +
                                            (uu * uu + vv * vv) * (1.0 / 588));
  }
  for (int j = 0; j < count; ++j) {
    const double variance = left_over[j] < 0.0 ? 0.0 : left_over[j] * (1.0 / (49 - 6));
    residual[j] = static_cast<float>(::sqrt(variance));
    slope[j] = variance == variance ? static_cast<float>(::sqrt(gradient[j]) * (1.0 / 196)) : NAN;
  }
}

struct Steps {
  float num_flat, smallest;
};

// NaN is no step.
NACRE_INLINE Steps add_step(const Steps& steps, float difference) {
  const float step = ::fabsf(difference), candidate = step == 0.0F ? INFINITY : step;
  return {steps.num_flat + (step == 0.0F ? 1.0F : 0.0F), candidate < steps.smallest ? candidate : steps.smallest};
}

NACRE_INLINE void find_steps(const float* centre, ptrdiff_t stride, int count, float* steps) {
  float across_flat[columns], across_smallest[columns];
  for (int i = 0; i < fit_step * (count - 1) + 1; ++i) {
    const float* const p = centre + i;
    Steps across = {0.0F, INFINITY};
    across = add_step(across, p[-2 * stride] - p[-3 * stride]);
    across = add_step(across, p[-stride] - p[-2 * stride]);
    across = add_step(across, p[0] - p[-stride]);
    across = add_step(across, p[stride] - p[0]);
    across = add_step(across, p[2 * stride] - p[stride]);
    across = add_step(across, p[3 * stride] - p[2 * stride]);
    across_flat[i] = across.num_flat;
    across_smallest[i] = across.smallest;
  }
  for (int j = 0; j < count; ++j) {
    const float* const p = centre + fit_step * j;
    Steps all = {across_flat[fit_step * j], across_smallest[fit_step * j]};
    for (int d = -fit_radius; d < fit_radius; ++d) all = add_step(all, p[d + 1] - p[d]);
    steps[j] = all.num_flat >= 2.0F * fit_radius && all.smallest < INFINITY ? all.smallest : 0.0F;
  }
}

}  // namespace

void fit_windows(const float* values, ptrdiff_t stride, int count, const WindowRow& out) {
  for (int begin = 0; begin < count; begin += tile) {
    const int windows = count - begin < tile ? count - begin : tile;
    const float* const centre = values + fit_step * begin;
    // About a value of the tile, so that plateaus leave nothing over.
    double origin = 0.0;
    for (int j = windows - 1; j >= 0; --j) {
      const float value = centre[fit_step * j];
      if (value == value) origin = value;
    }
    ColumnSums sums;
    sum_columns(centre - fit_radius, stride, fit_step * (windows - 1) + 2 * fit_radius + 1, origin, sums);
    fit(sums, windows, out.residual + begin, out.slope + begin);
    find_steps(centre, stride, windows, out.step + begin);
  }
}

}  // namespace nacre::simd::NACRE_ISA
