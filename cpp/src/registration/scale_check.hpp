// Is a source as large as what it was registered to?
#pragma once

#include <vector>

#include "base/numbers.hpp"
#include "registration/icp_step.hpp"

namespace nacre {

struct SizeDifference {
  double relative = 0.0;  // by which the source would have to grow to fit better
  double sigma = infinity<double>;
};

// Of pairs in the order of space, at rest: their least squares with one more unknown, a factor of the source about any
// point (the translation makes up for the choice). Rows are sums of neighbouring pairs, since what a surface lies off
// by is common to neighbours, and noise that is in the points is in the column of the factor, too.
SizeDifference size_difference(const std::vector<Pair>& pairs, Metric metric);

}  // namespace nacre
