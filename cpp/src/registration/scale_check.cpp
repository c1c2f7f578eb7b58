#include "registration/scale_check.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

// Weighted sums over neighbouring pairs.
struct RowSum {
  Vector6 pose = Vector6::Zero();  // rotation in units of the extent, translation
  double size = 0.0;               // a factor, in these units
  double right_side = 0.0;         // [m]
  double weight = 0.0;
  double noise = 0.0;  // squares of the single weighted residuals [m^2]

  void add(double w, const Eigen::Vector3d& p, const Eigen::Vector3d& difference, const Eigen::Vector3d& normal) {
    const double r = difference.dot(normal);
    pose.head<3>() += w * p.cross(normal);
    pose.tail<3>() += w * normal;
    size += w * p.dot(normal);
    right_side += w * r;
    weight += w;
    noise += w * w * r * r;
  }
};

std::vector<RowSum> sum_neighbours(const std::vector<Pair>& pairs, Metric metric, const Eigen::Vector3d& center,
                                   double extent) {
  std::vector<RowSum> rows((pairs.size() + registration_limits::cell_pairs - 1) / registration_limits::cell_pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pair& pair = pairs[i];
    const Eigen::Vector3d p = (pair.p - center) / extent, difference = pair.q - pair.p;
    RowSum& row = rows[i / registration_limits::cell_pairs];
    if (metric == Metric::point_to_point) {
      for (int axis = 0; axis < 3; ++axis) row.add(pair.weight, p, difference, Eigen::Vector3d::Unit(axis));
    } else {
      row.add(pair.weight, p, difference, pair.normal);
    }
  }
  rows.erase(std::remove_if(rows.begin(), rows.end(), [](const RowSum& row) { return !(row.weight > 0.0); }),
             rows.end());
  return rows;
}

}  // namespace

SizeDifference size_difference(const std::vector<Pair>& pairs, Metric metric) {
  double weight = 0.0, extent = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) {
    weight += pair.weight;
    center += pair.weight * pair.p;
  }
  if (!(weight > 0.0)) return {};
  center /= weight;
  for (const Pair& pair : pairs) extent += pair.weight * (pair.p - center).squaredNorm();
  extent = std::sqrt(std::max(extent / weight, 1e-24));

  const std::vector<RowSum> rows = sum_neighbours(pairs, metric, center, extent);
  if (rows.size() < registration_limits::least_scale_rows) return {};
  Matrix6 hessian = Matrix6::Identity() * base_limits::damping * weight;
  Vector6 mixed = Vector6::Zero(), gradient = Vector6::Zero();
  for (const RowSum& row : rows) {
    hessian.noalias() += row.pose * row.pose.transpose() / row.weight;
    mixed += row.size / row.weight * row.pose;
    gradient += row.right_side / row.weight * row.pose;
  }
  const Vector6 by_pose = solve_symmetric(hessian, mixed), motion = solve_symmetric(hessian, gradient);

  // What the motion cannot do: the rest of the column, on which the rest of the right side is regressed.
  const auto rest = [&](const RowSum& row) { return row.size - row.pose.dot(by_pose); };
  double information = base_limits::damping * weight, slope = 0.0, noise = 0.0;
  for (const RowSum& row : rows) {
    information += rest(row) * rest(row) / row.weight;
    slope += rest(row) * (row.right_side - row.pose.dot(motion)) / row.weight;
    noise += row.noise / row.weight;
  }
  const double size = slope / information;
  double variance = 0.0;  // heteroscedastic, White 1980
  for (const RowSum& row : rows) {
    const double residual = row.right_side - row.pose.dot(motion) - size * rest(row);
    variance += std::pow(rest(row) * residual / row.weight, 2);
  }
  const auto count = static_cast<double>(rows.size());
  const double sigma = std::sqrt(variance * count / (count - 7.0)) / information;
  const double bias = noise / (extent * information);  // at most, by noise that is in the column
  return {size / extent, std::hypot(sigma, bias) / extent};
}

}  // namespace nacre
