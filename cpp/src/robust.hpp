// Statistics that outliers hardly change.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace nacre {

constexpr double mad_to_sigma = 1.4826;  // median absolute deviation of a Gaussian to its standard deviation

// Of at least one value; of an even number the larger of the two in the middle.
template <class T>
T median_of(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Geman and McClure 1985: what is left of the weight of a residual. Beyond three sigma it is an outlier.
inline double robust_weight(double residual, double sigma, double weight = 1.0) {
  const double ratio = residual / (3.0 * sigma);
  return weight / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
}

}  // namespace nacre
