// Eight pairs at a time, one in each lane of sums that are added up at the end, so that every instruction set gives the
// same bits. About 16 operations a pair with vectors of eight.
#include "simd/icp_equations.hpp"

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int row_width = 8;
using Lanes = double[row_width];

// c(n) = (lever x n, n)
NACRE_INLINE void fill_row(const Lanes (&lever)[3], const Lanes (&normal)[3], Lanes (&row)[6]) {
  for (int i = 0; i < row_width; ++i) {
    row[0][i] = lever[1][i] * normal[2][i] - lever[2][i] * normal[1][i];
    row[1][i] = lever[2][i] * normal[0][i] - lever[0][i] * normal[2][i];
    row[2][i] = lever[0][i] * normal[1][i] - lever[1][i] * normal[0][i];
    row[3][i] = normal[0][i];
    row[4][i] = normal[1][i];
    row[5][i] = normal[2][i];
  }
}

NACRE_INLINE void add_product(const Lanes (&row)[6], const Lanes& weight, Lanes (&sums)[21]) {
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    Lanes weighted;
    for (int i = 0; i < row_width; ++i) weighted[i] = weight[i] * row[a][i];
    for (int b = a; b < 6; ++b, ++k) {
      for (int i = 0; i < row_width; ++i) sums[k][i] += weighted[i] * row[b][i];
    }
  }
}

NACRE_INLINE double sum_of(const Lanes& v) { return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])); }

}  // namespace

void sum_pair_equations(const PairRow* pairs, int64_t count, PairEquations& out) {
  Lanes hessian[21], chance[21], gradient[6];
  memset(hessian, 0, sizeof hessian);
  memset(chance, 0, sizeof chance);
  memset(gradient, 0, sizeof gradient);
  for (int64_t first = 0; first < count; first += row_width) {
    Lanes lever[3], normal[3], difference[3], right_side, weight, row[6];
    for (int i = 0; i < row_width; ++i) {
      // Lanes past the end repeat a pair without weight.
      const bool is_pair = first + i < count;
      const PairRow& pair = pairs[is_pair ? first + i : first];
      for (int axis = 0; axis < 3; ++axis) {
        lever[axis][i] = pair.lever[axis];
        normal[axis][i] = pair.normal[axis];
        difference[axis][i] = pair.half_difference[axis];
      }
      right_side[i] = pair.right_side;
      weight[i] = is_pair ? pair.weight : 0.0;
    }
    fill_row(lever, difference, row);
    add_product(row, weight, chance);
    fill_row(lever, normal, row);
    add_product(row, weight, hessian);
    for (int a = 0; a < 6; ++a) {
      for (int i = 0; i < row_width; ++i) gradient[a][i] += weight[i] * right_side[i] * row[a][i];
    }
  }
  for (int k = 0; k < 21; ++k) {
    out.hessian[k] = sum_of(hessian[k]);
    out.chance[k] = sum_of(chance[k]);
  }
  for (int a = 0; a < 6; ++a) out.gradient[a] = sum_of(gradient[a]);
}

}  // namespace nacre::simd::NACRE_ISA
