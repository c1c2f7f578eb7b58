// Vectors without marks cost nothing; in the others about 200 operations for each side on which a surface begins.
#include "simd/depth_planar_edges.hpp"

#include "simd/depth_edges.hpp"
#include "simd/quadratic.hpp"
#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int margin = side_depth, pitch = chunk + 2 * margin + lanes;
constexpr int num_rows = 2 * side_depth + 1, side_size = side_depth * (2 * side_reach + 1);
constexpr float least_members = 0.5F * side_size;
constexpr float largest_misfit = 1.5F;  // squared residuals per degree of freedom, in variances

// The values of unmarked pixels around a chunk, NaN elsewhere.
struct Unmarked {
  float values[num_rows * pitch];
  const float* at(int u) const { return values + side_depth * pitch + margin + u; }
};

NACRE_INLINE void gather(const PlanarRow& row, const PlanarMarks& marks, int begin, int count, Unmarked& unmarked) {
  for (int i = 0; i < num_rows; ++i) {
    const ptrdiff_t v = i - side_depth;
    const float* const values = row.values + v * row.stride + begin - margin;
    const uint8_t* const marked = marks.marks + v * marks.stride + begin - margin;
    float* const target = unmarked.values + i * pitch;
    const int width = count + 2 * margin;
    for (int u = 0; u < width; ++u) target[u] = values[u] + (marked[u] == 0 ? 0.0F : NAN);
    for (int u = width; u < pitch; ++u) target[u] = NAN;
  }
}

struct Prediction {
  F32 error, variance;  // of the plane at the pixel: squared, of its value; in units of one value's variance
};

// Fits value = w + along at_along + across at_across to the pixels of one side, whose first is `ahead` away.
NACRE_INLINE void fit_side(const float* pixel, F32 own, ptrdiff_t ahead, ptrdiff_t aside, Mask asked, F32 variance,
                           F32 steepest, Prediction& best) {
  const Mask is_beside = asked & (load(pixel + ahead) == load(pixel + ahead));
  if (!any(is_beside)) return;
  const F32 zero = broadcast(0.0F);
  const I32 byte = broadcast(255);
  F32 n = zero, a = zero, x = zero, aa = zero, ax = zero, xx = zero, w = zero, aw = zero, ww = zero;
  F32 across_w[2 * side_reach + 1];
  for (F32& sum : across_w) sum = zero;
  for (int along = 1; along <= side_depth; ++along) {
    I32 counts = broadcast(0);  // n + 2^8 sum (across + reach) + 2^16 sum across^2
    F32 row_w = zero;
    for (int across = -side_reach; across <= side_reach; ++across) {
      const F32 d = load(pixel + along * ahead + across * aside) - own;
      const Mask member = d == d;
      const F32 difference = select(member, d, zero);
      counts = add_where(member, counts, broadcast(1 + (across + side_reach) * (1 << 8) + across * across * (1 << 16)));
      row_w += difference;
      across_w[across + side_reach] += difference;
      ww += difference * difference;
    }
    const F32 k = broadcast(static_cast<float>(along)), row_n = to_float(counts & byte);
    const F32 row_x = to_float(shift_right<8>(counts) & byte) - broadcast(static_cast<float>(side_reach)) * row_n;
    n += row_n;
    a += k * row_n;
    aa += k * k * row_n;
    x += row_x;
    ax += k * row_x;
    xx += to_float(shift_right<16>(counts));
    w += row_w;
    aw += k * row_w;
  }
  F32 xw = zero;
  for (int i = 0; i <= 2 * side_reach; ++i) xw += broadcast(static_cast<float>(i - side_reach)) * across_w[i];

  // The normal equations times n, so that the matrix is of integers; half a window cannot be in a line.
  const F32 naa = n * aa - a * a, nax = n * ax - a * x, nxx = n * xx - x * x;
  const F32 naw = n * aw - a * w, nxw = n * xw - x * w;
  const F32 inverse = broadcast(1.0F) / (naa * nxx - nax * nax), per_member = broadcast(1.0F) / n;
  const F32 at_along = (nxx * naw - nax * nxw) * inverse, at_across = (naa * nxw - nax * naw) * inverse;
  const F32 predicted = (w - a * at_along - x * at_across) * per_member;
  const F32 misfit = (n * ww - w * w - at_along * naw - at_across * nxw) * per_member;
  const F32 leverage = per_member + (a * a * nxx - (a * x + a * x) * nax + x * x * naa) * (inverse * per_member);
  const Mask counts = is_beside & (n > broadcast(least_members)) &
                      (misfit <= broadcast(largest_misfit) * variance * (n - broadcast(3.0F))) &
                      (at_along * at_along + at_across * at_across <= steepest * steepest) & (leverage < best.variance);
  best = {select(counts, predicted * predicted, best.error), select(counts, leverage, best.variance)};
}

NACRE_INLINE Mask is_planar(const float* pixel, F32 own, Mask asked, const PlanarRule& rule) {
  const F32 sigma = evaluate(rule.sigma, own), steepest = evaluate(rule.steepest, own), variance = sigma * sigma;
  Prediction best = {broadcast(0.0F), broadcast(HUGE_VALF)};
  fit_side(pixel, own, -1, pitch, asked, variance, steepest, best);
  fit_side(pixel, own, 1, pitch, asked, variance, steepest, best);
  fit_side(pixel, own, -pitch, 1, asked, variance, steepest, best);
  fit_side(pixel, own, pitch, 1, asked, variance, steepest, best);
  return asked & (best.variance < broadcast(HUGE_VALF)) &
         (best.error <= broadcast(rule.squared_sigmas) * variance * (broadcast(1.0F) + best.variance));
}

}  // namespace

void keep_planar_pixels(const PlanarRow& row, const PlanarRule& rule, const PlanarMarks& marks, uint8_t* left_marked) {
  const PlanarRule r = rule;
  for (int begin = 0; begin < row.width; begin += chunk) {
    const int count = row.width - begin < chunk ? row.width - begin : chunk;
    const uint8_t *const marked = marks.marks + begin, *const first = marks.first_marks + begin;
    int32_t asked[chunk], num_asked = 0;
    for (int i = 0; i < chunk; ++i) asked[i] = 0;
    for (int i = 0; i < count; ++i) {
      asked[i] = (marked[i] != 0) & ((first[i] & slanted_mark) == 0);
      num_asked += asked[i];
      left_marked[begin + i] = marked[i];
    }
    if (num_asked == 0) continue;
    Unmarked unmarked;
    gather(row, marks, begin, count, unmarked);
    for (int i = 0; i < count; i += lanes) {
      const Mask here = to_float(load(asked + i)) > broadcast(0.0F);
      if (!any(here)) continue;
      unsigned found = bits(is_planar(unmarked.at(i), load(row.values + begin + i), here, r));
      for (int u = begin + i; found != 0; ++u, found >>= 1U) {
        if ((found & 1U) != 0) left_marked[u] = 0;
      }
    }
  }
}

}  // namespace nacre::simd::NACRE_ISA
