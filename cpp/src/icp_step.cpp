#include "icp_step.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cmath>

#include "parallel.hpp"

namespace nacre {
namespace {

constexpr std::int64_t block_size = 2048;
constexpr double damping = 1e-9;          // information per pair, so that there always is a solution
constexpr double unknown_chance = 0.008;  // information that normals off by 5 degrees feign

struct Centroids {
  double weight = 0.0, squares = 0.0, weighted_squares = 0.0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), q = Eigen::Vector3d::Zero();

  Centroids& operator+=(const Centroids& other) {
    weight += other.weight;
    squares += other.squares;
    weighted_squares += other.weighted_squares;
    p += other.p;
    q += other.q;
    return *this;
  }
};

Centroids sum_centroids(const std::vector<Pair>& pairs, Metric metric, int num_threads) {
  const auto count = static_cast<std::int64_t>(pairs.size());
  return block_reduce(count, block_size, num_threads, Centroids{}, [&](std::int64_t begin, std::int64_t end) {
    Centroids sum;
    for (std::int64_t i = begin; i < end; ++i) {
      const Pair& pair = pairs[static_cast<std::size_t>(i)];
      const double r = residual(pair, metric);
      sum.weight += pair.weight;
      sum.squares += r * r;
      sum.weighted_squares += pair.weight * r * r;
      sum.p += pair.weight * pair.p;
      sum.q += pair.weight * pair.q;
    }
    return sum;
  });
}

// The normal equations of the linearised residuals, and what the closed-form point-to-point solution needs.
struct NormalEquations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  Matrix6 chance = Matrix6::Zero();                      // the part of the hessian that noise in the normals feigns
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // sum of w q~ p~^T

  NormalEquations& operator+=(const NormalEquations& other) {
    hessian += other.hessian;
    gradient += other.gradient;
    chance += other.chance;
    covariance += other.covariance;
    return *this;
  }
  void add(const Vector6& row, double right_side, double weight) {
    hessian.noalias() += weight * row * row.transpose();
    gradient.noalias() += weight * right_side * row;
  }
  // With rows c(n) for a normal n, normals n +- d of the two points whose errors are independent agree on
  // c(n + d) c(n - d)^T, symmetrised c(n) c(n)^T - c(d) c(d)^T: noise cancels there and not in c(n) c(n)^T.
  void add_chance(const Eigen::Vector3d& place, double extent, const Pair& pair) {
    if (!pair.half_difference.allFinite()) {
      chance.diagonal().array() += unknown_chance * pair.weight;
      return;
    }
    Vector6 row;
    row << place.cross(pair.half_difference) / extent, pair.half_difference;
    chance.noalias() += pair.weight * row * row.transpose();
  }
};

// Unknowns: rotation times extent, translation of the centroid. Rotations are about the centroids, so that rotation and
// translation are as independent as they can be.
NormalEquations build_equations(const std::vector<Pair>& pairs, Metric metric, const Eigen::Vector3d& p_mean,
                                const Eigen::Vector3d& q_mean, double extent, int num_threads) {
  const auto count = static_cast<std::int64_t>(pairs.size());
  return block_reduce(count, block_size, num_threads, NormalEquations{}, [&](std::int64_t begin, std::int64_t end) {
    NormalEquations sum;
    for (std::int64_t i = begin; i < end; ++i) {
      const Pair& pair = pairs[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p = pair.p - p_mean, q = pair.q - q_mean;
      if (metric == Metric::point_to_point) {
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
          Vector6 row;
          row << p.cross(unit) / extent, unit;
          sum.add(row, (pair.q - pair.p)[axis], pair.weight);
        }
        sum.covariance.noalias() += pair.weight * q * p.transpose();
      } else if (metric == Metric::point_to_plane) {
        // Chen and Medioni 1992 with small angles: (p + a x p + t - q) . n = 0, q about p's centroid.
        Vector6 row;
        row << p.cross(pair.normal) / extent, pair.normal;
        sum.add(row, (pair.q - pair.p).dot(pair.normal), pair.weight);
      } else {
        // Rusinkiewicz 2019, eq. 9, with the total rotation 2 a~ as the unknown.
        const Eigen::Vector3d middle = 0.5 * (p + q);
        Vector6 row;
        row << middle.cross(pair.normal) / extent, pair.normal;
        sum.add(row, (pair.q - pair.p).dot(pair.normal), pair.weight);
      }
      sum.add_chance(0.5 * (p + q), extent, pair);
    }
    return sum;
  });
}

// Rodrigues' formula.
Eigen::Matrix3d rotation(const Eigen::Vector3d& axis, double angle) {
  const double length = axis.norm();
  if (!(length > 0.0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, axis / length).toRotationMatrix();
}

Pose motion_about(const Eigen::Vector3d& from_center, const Eigen::Matrix3d& rotation,
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

}  // namespace

IcpStep solve_step(const std::vector<Pair>& pairs, Metric metric, double weak_threshold, int num_threads) {
  IcpStep step;
  const Centroids sums = sum_centroids(pairs, metric, num_threads);
  if (!(sums.weight > 0.0)) return step;
  const Eigen::Vector3d p_mean = sums.p / sums.weight, q_mean = sums.q / sums.weight;
  step.center = q_mean;
  step.rmse = std::sqrt(sums.squares / static_cast<double>(pairs.size()));
  step.variance = sums.weighted_squares / sums.weight;

  double squared_extent = 0.0;
  for (const Pair& pair : pairs) squared_extent += pair.weight * (pair.p - p_mean).squaredNorm();
  const double extent = std::sqrt(std::max(squared_extent / sums.weight, 1e-24));

  const NormalEquations equations = build_equations(pairs, metric, p_mean, q_mean, extent, num_threads);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(equations.hessian - equations.chance);
  const Eigen::Index num_weak =
      weak_threshold > 0.0 ? (eigen.eigenvalues().array() < weak_threshold * sums.weight).count() : 0;
  step.weak_directions = eigen.eigenvectors().leftCols(num_weak);
  const Eigen::Matrix<double, 6, Eigen::Dynamic> sure = eigen.eigenvectors().rightCols(6 - num_weak);
  Matrix6 damped = equations.hessian;
  damped.diagonal().array() += damping * sums.weight;
  const Vector6 solution =
      sure * (sure.transpose() * damped * sure).ldlt().solve(sure.transpose() * equations.gradient);
  Vector6 scale;
  scale << extent, extent, extent, 1.0, 1.0, 1.0;
  step.hessian = scale.asDiagonal() * equations.hessian * scale.asDiagonal();

  const Eigen::Vector3d rotation_vector = solution.head<3>() / extent, translation = solution.tail<3>();
  if (metric == Metric::point_to_point && num_weak == 0) {
    step.motion = motion_about(p_mean, closest_rotation(equations.covariance), q_mean);
  } else if (metric == Metric::symmetric && num_weak == 0) {
    // Rusinkiewicz 2019, section 3: half the rotation, the translation t cos(theta), half the rotation.
    const double half_angle = std::atan(0.5 * rotation_vector.norm());
    const Eigen::Matrix3d half = rotation(rotation_vector, half_angle);
    const Eigen::Vector3d shift = translation - (q_mean - p_mean);
    step.motion = motion_about(p_mean, half * half, q_mean + half * shift * std::cos(half_angle));
  } else {
    step.motion = motion_about(p_mean, rotation(rotation_vector, rotation_vector.norm()), p_mean + translation);
  }
  const double angle = Eigen::AngleAxisd(step.motion.linear()).angle();
  step.size = (step.motion * p_mean - p_mean).norm() + angle * extent;
  return step;
}

}  // namespace nacre
