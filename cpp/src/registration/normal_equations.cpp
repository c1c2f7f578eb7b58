#include "registration/normal_equations.hpp"

#include "base/parallel.hpp"
#include "registration/limits.hpp"
#include "simd/icp_equations.hpp"

namespace nacre {
namespace {

constexpr std::int64_t equation_block = 256;

Matrix6 symmetric(const double* upper) {
  Matrix6 matrix;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) matrix(row, column) = matrix(column, row) = *upper++;
  }
  return matrix;
}

simd::PairRow row_of(const Pair& pair, double weight, const Eigen::Vector3d& lever, const Eigen::Vector3d& normal) {
  simd::PairRow row;
  const bool knows_both = pair.half_difference.allFinite();
  for (int axis = 0; axis < 3; ++axis) {
    row.lever[axis] = lever[axis];
    row.normal[axis] = normal[axis];
    row.half_difference[axis] = knows_both ? pair.half_difference[axis] : 0.0;
  }
  row.right_side = (pair.q - pair.p).dot(normal);
  row.weight = weight;
  return row;
}

}  // namespace

NormalEquations normal_equations(const std::vector<Pair>& pairs, Metric metric, double Pair::*weight,
                                 const Eigen::Vector3d& p_mean, const Eigen::Vector3d& q_mean, double extent,
                                 int num_threads) {
  const auto count = static_cast<std::int64_t>(pairs.size());
  return block_reduce(count, equation_block, num_threads, NormalEquations{}, [&](std::int64_t begin, std::int64_t end) {
    NormalEquations sum;
    simd::PairRow rows[3 * equation_block];
    std::int64_t num_rows = 0;
    double weight_of_single = 0.0;
    for (std::int64_t i = begin; i < end; ++i) {
      const Pair& pair = pairs[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p = pair.p - p_mean, q = pair.q - q_mean;
      if (metric == Metric::point_to_point) {
        for (int axis = 0; axis < 3; ++axis)
          rows[num_rows++] = row_of(pair, pair.*weight, p / extent, Eigen::Vector3d::Unit(axis));
        sum.covariance.noalias() += pair.*weight * q * p.transpose();
      } else if (metric == Metric::point_to_plane || metric == Metric::paper) {
        // Chen and Medioni 1992 with small angles: (p + a x p + t - q) . n = 0, q about p's centroid.
        rows[num_rows++] = row_of(pair, pair.*weight, p / extent, pair.normal);
      } else {
        // Rusinkiewicz 2019, eq. 9, with the total rotation 2 a~ as the unknown.
        rows[num_rows++] = row_of(pair, pair.*weight, (p + q) * (0.5 / extent), pair.normal);
      }
      if (!pair.half_difference.allFinite()) weight_of_single += pair.*weight;
    }
    simd::PairEquations sums;
    simd::sum_pair_equations()(rows, num_rows, sums);
    sum.hessian = symmetric(sums.hessian);
    sum.chance = symmetric(sums.chance);
    sum.chance.diagonal().array() += registration_limits::unknown_noise_bias * weight_of_single;
    sum.gradient = Eigen::Map<const Vector6>(sums.gradient);
    return sum;
  });
}

}  // namespace nacre
