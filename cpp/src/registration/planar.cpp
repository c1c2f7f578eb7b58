#include "registration/planar.hpp"

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

// Least squares of the residuals, about the middle of the pairs.
Pose plane_step(const std::vector<Pair>& pairs, const Eigen::Vector3d& normal) {
  MotionBasis motion = MotionBasis::on_plane(normal, Eigen::Vector3d::Zero());
  for (const Pair& pair : pairs) motion.center += pair.p / static_cast<double>(pairs.size());
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) {
    const MotionBasis::Amounts row = motion.row(pair);
    hessian += pair.weight * row * row.transpose();
    gradient -= pair.weight * row * residual(pair, Metric::symmetric);
  }
  hessian.diagonal().array() += 1e-9 * hessian.trace();
  return motion.apply(Eigen::Vector3d(hessian.ldlt().solve(gradient)));
}

}  // namespace

void weight_robustly(std::vector<Pair>& pairs, double floor) {
  std::vector<double> sizes;
  sizes.reserve(pairs.size());
  for (const Pair& pair : pairs) sizes.push_back(std::abs(residual(pair, Metric::symmetric)));
  const double scale = std::max(floor, mad_to_sigma * median_of(std::move(sizes)));
  for (Pair& pair : pairs) pair.weight = pair.agreement = robust_weight(residual(pair, Metric::symmetric), scale);
}

IcpResult align_on_plane(const IcpTarget& target, const IcpSource& source, const Pose& initial,
                         const Eigen::Vector3d& normal, const PlaneGates& gates) {
  IcpResult result;
  result.target_from_source = initial;
  result.rmse = std::numeric_limits<double>::quiet_NaN();
  const std::int64_t count = std::min<std::int64_t>(gates.num_samples, source.cloud.points.rows());
  const double floor = 0.05 * gates.last;
  std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source.cloud.points.rows()), no_slot);
  Pose pose = initial;
  bool at_rest = false;
  double distance = gates.first;
  for (int i = 0; i < gates.max_iterations && !at_rest; ++i) {
    std::vector<Pair> pairs =
        target.match(source, count, pose, {distance, registration_limits::planar_cosine, false}, nearest);
    if (pairs.size() < registration_limits::least_planar_pairs) return result;
    weight_robustly(pairs, floor);
    const Pose motion = plane_step(pairs, normal);
    pose = motion * pose;
    const bool is_smallest = distance <= gates.last;
    at_rest = is_smallest && (motion * pairs.front().p - pairs.front().p).norm() < 0.1 * floor;
    distance = std::max(gates.last, registration_limits::planar_decay * distance);
    result.iterations = i + 1;
  }
  std::vector<Pair> pairs =
      target.match(source, count, pose, {gates.last, registration_limits::planar_cosine, false}, nearest);
  if (pairs.size() < registration_limits::least_planar_pairs) return result;
  weight_robustly(pairs, floor);
  const IcpStep last = solve_step(pairs, Metric::symmetric, 0.0, 1);
  result.target_from_source = pose;
  result.status = at_rest ? AlignStatus::converged : AlignStatus::max_iterations;
  result.num_inliers = static_cast<int>(pairs.size());
  result.overlap = static_cast<double>(pairs.size()) / static_cast<double>(count);
  result.rmse = last.rmse;
  result.residual_ratio = last.rmse / gates.last;
  result.center = last.center;
  result.information = last.hessian / std::max(last.variance, floor * floor);
  result.weak_directions.resize(6, 0);
  return result;
}

}  // namespace nacre
