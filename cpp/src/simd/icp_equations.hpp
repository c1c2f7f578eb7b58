// The normal equations of ICP.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

// A pair as the equations see it: the lever that turns act on, the direction that the residual counts along, half the
// difference of the two points' normals, and what the motion should make of the residual.
struct PairRow {
  double lever[3];  // relative to the centre, in units of the pairs' extent
  double normal[3];
  double half_difference[3];
  double right_side;
  double weight;
};

struct PairEquations {
  double hessian[21];  // sum of w c(n) c(n)^T with c(n) = (lever x n, n): the upper triangle, row by row
  double chance[21];   // sum of w c(d) c(d)^T with half the difference d of the normals
  double gradient[6];  // sum of w right_side c(n)
};

using SumPairEquations = void(const PairRow* pairs, int64_t count, PairEquations& sums);
NACRE_DECLARE_KERNEL(SumPairEquations, sum_pair_equations)

}  // namespace nacre::simd
