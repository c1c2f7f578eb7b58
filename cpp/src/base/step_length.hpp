// Steps of Gauss and Newton where weights and matches change with the residuals.
#pragma once

#include <algorithm>

#include "base/limits.hpp"

namespace nacre {

// How many times its length to make a step, after one that was made `length` times the last: that left a part of itself
// to do, which shows in the new one (Barzilai and Borwein 1988). As it is where there was none (0).
template <class Vector, class Matrix>
double step_length(const Vector& last, double length, const Vector& step, const Matrix& metric) {
  const Vector scaled = metric * last;
  const double whole = last.dot(scaled);
  if (!(whole > 0.0)) return 1.0;
  const double done = 1.0 - step.dot(scaled) / whole;
  return std::max(1.0, length / std::max(done, length / base_limits::longest_step));
}

}  // namespace nacre
