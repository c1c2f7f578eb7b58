// Statistics that outliers hardly change.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <utility>
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

template <class Derived>
typename Derived::Scalar median_of(const Eigen::DenseBase<Derived>& values) {
  std::vector<typename Derived::Scalar> copy(static_cast<std::size_t>(values.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) copy[static_cast<std::size_t>(i)] = values(i);
  return median_of(std::move(copy));
}

// Geman and McClure 1985: what is left of the weight of a residual. Beyond three sigma it is an outlier.
inline double robust_weight(double residual, double sigma, double weight = 1.0) {
  const double ratio = residual / (3.0 * sigma);
  return weight / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
}

}  // namespace nacre
