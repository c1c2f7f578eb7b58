#include "registration/icp_step.hpp"

#include <Eigen/SVD>
#include <cmath>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "base/step_length.hpp"
#include "registration/limits.hpp"
#include "registration/normal_equations.hpp"

namespace nacre {
namespace {

constexpr std::int64_t step_block = 256;

struct Moments {
  double weight = 0.0, agreement = 0.0, squares = 0.0, weighted_squares = 0.0;
  double extent = 0.0;  // sum of w |p - origin|^2
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), q = Eigen::Vector3d::Zero();

  Moments& operator+=(const Moments& other) {
    weight += other.weight;
    agreement += other.agreement;
    squares += other.squares;
    weighted_squares += other.weighted_squares;
    extent += other.extent;
    p += other.p;
    q += other.q;
    return *this;
  }
};

// Points relative to an origin near them.
Moments sum_moments(const std::vector<Pair>& pairs, Metric metric, const Eigen::Vector3d& origin, int num_threads) {
  const auto count = static_cast<std::int64_t>(pairs.size());
  return block_reduce(count, step_block, num_threads, Moments{}, [&](std::int64_t begin, std::int64_t end) {
    Moments sum;
    for (std::int64_t i = begin; i < end; ++i) {
      const Pair& pair = pairs[static_cast<std::size_t>(i)];
      const double r = residual(pair, metric);
      const Eigen::Vector3d p = pair.p - origin;
      sum.weight += pair.weight;
      sum.agreement += pair.agreement;
      sum.squares += r * r;
      sum.weighted_squares += pair.weight * r * r;
      sum.extent += pair.weight * p.squaredNorm();
      sum.p += pair.weight * p;
      sum.q += pair.weight * (pair.q - origin);
    }
    return sum;
  });
}

Pose motion_from_to(const Eigen::Vector3d& from_center, const Eigen::Matrix3d& rotation,
                    const Eigen::Vector3d& to_center) {
  Pose motion = Pose::Identity();
  motion.linear() = rotation;
  motion.translation() = to_center - rotation * from_center;
  return motion;
}

// The rotation closest to covariance (Kabsch 1976).
Eigen::Matrix3d closest_rotation(const Eigen::Matrix3d& covariance) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign(2, 2) = -1.0;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

void append_column(TwistBasis& basis, const Vector6& column) {
  basis.conservativeResize(6, basis.cols() + 1);
  basis.rightCols<1>() = column;
}

}  // namespace

double normal_information(const std::vector<Pair>& pairs, Metric metric) {
  Eigen::Vector3d source_sum = Eigen::Vector3d::Zero(), target_sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero(), differences = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (const Pair& pair : pairs) {
    if (!pair.half_difference.allFinite()) continue;
    const Eigen::Vector3d target =
        metric == Metric::symmetric ? Eigen::Vector3d(pair.normal - pair.half_difference) : pair.normal;
    const Eigen::Vector3d difference = 2.0 * pair.half_difference, source = target + difference;
    source_sum += source;
    target_sum += target;
    squares += source * source.transpose() + target * target.transpose();
    differences += difference * difference.transpose();
    count += 1.0;
  }
  if (!(count > 0.0)) return 0.0;
  const Eigen::Matrix3d floor = registration_limits::least_variance * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d apart = differences / count + floor;
  const Eigen::Matrix3d independent =
      (squares - (source_sum * source_sum.transpose() + target_sum * target_sum.transpose()) / count) / count + floor;
  return std::max(0.0, 0.5 * std::log(independent.determinant() / apart.determinant()));
}

IcpStep solve_step(const std::vector<Pair>& pairs, Metric metric, const WeakTest& test, const TwistBasis& along,
                   int num_threads, StepBefore* before) {
  IcpStep step;
  if (pairs.empty()) return step;
  const Eigen::Vector3d origin = pairs.front().q;
  const Moments sums = sum_moments(pairs, metric, origin, num_threads);
  if (!(sums.weight > 0.0)) return step;
  const Eigen::Vector3d p_offset = sums.p / sums.weight;
  const Eigen::Vector3d p_mean = origin + p_offset, q_mean = origin + sums.q / sums.weight;
  step.center = q_mean;
  step.rmse = std::sqrt(sums.squares / static_cast<double>(pairs.size()));
  step.variance = sums.weighted_squares / sums.weight;
  const double extent = std::sqrt(std::max(sums.extent / sums.weight - p_offset.squaredNorm(), 1e-24));
  step.extent = extent;

  const NormalEquations equations = normal_equations(pairs, metric, &Pair::weight, p_mean, q_mean, extent, num_threads);
  const bool has_test = test.least_information > 0.0;
  const NormalEquations shape =
      has_test ? normal_equations(pairs, metric, &Pair::agreement, p_mean, q_mean, extent, num_threads) : equations;
  const Eigensystem eigen = eigensystem(shape.hessian - shape.chance);
  const Vector6 feigned = (eigen.vectors.transpose() * shape.chance * eigen.vectors).diagonal();
  const double least = test.least_information * sums.agreement;
  Vector6 scale;
  scale << extent, extent, extent, 1.0, 1.0, 1.0;
  const Matrix6 by_scale = scale.cwiseInverse().asDiagonal();
  const Matrix6 otherwise = sums.agreement * (by_scale * test.told_otherwise * by_scale);
  const Vector6 told_otherwise = (eigen.vectors.transpose() * otherwise * eigen.vectors).diagonal();
  const Vector6 needed = told_otherwise.cwiseMax(test.least_signal * feigned.cwiseMax(least)).cwiseMax(least);
  TwistBasis sure(6, 0);
  step.weak_directions.resize(6, 0);
  for (Eigen::Index i = 0; i < 6; ++i) {
    append_column(has_test && eigen.values[i] < needed[i] ? step.weak_directions : sure, eigen.vectors.col(i));
  }
  if (has_test) {
    step.signal = eigen.values.cwiseQuotient(feigned.cwiseMax(least)).minCoeff();
    step.weakest = eigen.vectors.col(0).cwiseQuotient(scale);
    step.weakest_part = eigen.values[0] / sums.agreement;
  }
  const bool is_free = sure.cols() == 6 && along.cols() == 0;
  if (along.cols() > 0) sure = along;
  Matrix6 damped = equations.hessian;
  damped.diagonal().array() += base_limits::damping * sums.weight;
  Vector6 solution = sure * solve_symmetric(sure.transpose() * damped * sure, sure.transpose() * equations.gradient);
  step.reduction = solution.dot(equations.hessian * solution);
  step.hessian = scale.asDiagonal() * equations.hessian * scale.asDiagonal();
  const Eigen::Matrix<double, 6, 6> axes = scale.asDiagonal() * eigen.vectors;
  step.shape = axes * Vector6(eigen.values.cwiseMax(0.0)).asDiagonal() * axes.transpose();

  if (before != nullptr) {
    const Vector6 twist = solution.cwiseQuotient(scale);
    before->length = step_length(before->twist, before->length, twist, step.hessian);
    before->twist = twist;
    solution *= before->length;
  }

  const Eigen::Vector3d rotation_vector = solution.head<3>() / extent, translation = solution.tail<3>();
  if (metric == Metric::point_to_point && is_free) {
    step.motion = motion_from_to(p_mean, closest_rotation(equations.covariance), q_mean);
  } else if (metric == Metric::symmetric && is_free) {
    // Rusinkiewicz 2019, section 3: half the rotation, the translation t cos(theta), half the rotation.
    const double half_angle = std::atan(0.5 * rotation_vector.norm());
    const Eigen::Matrix3d half = rotation(rotation_vector, half_angle);
    const Eigen::Vector3d shift = translation - (q_mean - p_mean);
    step.motion = motion_from_to(p_mean, half * half, q_mean + half * shift * std::cos(half_angle));
  } else {
    step.motion = motion_from_to(p_mean, rotation(rotation_vector, rotation_vector.norm()), p_mean + translation);
  }
  const double angle = Eigen::AngleAxisd(step.motion.linear()).angle();
  step.size = (step.motion * p_mean - p_mean).norm() + angle * extent;
  return step;
}

}  // namespace nacre
