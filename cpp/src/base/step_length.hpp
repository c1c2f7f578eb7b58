// Steps of Gauss and Newton where weights and matches change with the residuals.
#pragma once

#include <algorithm>

#include "base/limits.hpp"

namespace nacre {

// How many times to take a step of Gauss and Newton, after the last was taken `length` times: what that one left to do
// shows in the new one (Barzilai and Borwein 1988). Once, where there was none (0); at least once.
template <class Vector, class Matrix>
double step_length(const Vector& last, double length, const Vector& step, const Matrix& metric) {
  const Vector scaled = metric * last;
  const double whole = last.dot(scaled);
  if (!(whole > 0.0)) return 1.0;
  const double done = 1.0 - step.dot(scaled) / whole;
  return std::max(1.0, length / std::max(done, length / base_limits::longest_step));
}

}  // namespace nacre
