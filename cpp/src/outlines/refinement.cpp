#include "outlines/refinement.hpp"

#include <Eigen/LU>
#include <cmath>

#include "base/linear_algebra.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "outlines/limits.hpp"
#include "outlines/match.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

// What outlines say of a twist.
struct OutlineEquations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  std::size_t count = 0;
  double squares = 0.0;  // of the residuals [m^2]
};

// An unknown shift of the outline as a whole, known to be about nothing, is eliminated (Schur complement).
OutlineEquations equations_of(const std::vector<OutlinePoint>& edges,
                              const std::vector<std::vector<OutlinePoint>>& earlier, const Eigen::Vector3d& center,
                              double pixel, int num_threads) {
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  OutlineEquations equations;
  Matrix9 hessian = Matrix9::Zero();
  Vector9 gradient = Vector9::Zero();
  const double sigma = outlines_limits::point_sigma * pixel;
  const double certainty =
      1.0 / (sigma * sigma * outlines_limits::points_for_one * static_cast<double>(earlier.size()));
  for (const std::vector<OutlinePoint>& seen : earlier) {
    const std::vector<int> nearest = nearest_edges(edges, seen, outlines_limits::last_gate * pixel, num_threads);
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      if (nearest[i] < 0) continue;
      const OutlinePoint &edge = edges[i], &other = seen[static_cast<std::size_t>(nearest[i])];
      const Eigen::Vector3d across = (edge.outward + other.outward).normalized();
      const double residual = (edge.point - other.point).dot(across);
      const double weight = robust_weight(residual, sigma, certainty);
      Vector9 row;
      row << (edge.point - center).cross(across), across, across;
      hessian += weight * row * row.transpose();
      gradient += weight * residual * row;
      equations.squares += residual * residual;
      ++equations.count;
    }
  }
  hessian.diagonal().tail<3>().array() +=
      1.0 / (outlines_limits::point_sigma * pixel * outlines_limits::point_sigma * pixel);
  const Eigen::Matrix<double, 6, 3> mixed = hessian.topRightCorner<6, 3>();
  const Eigen::Matrix<double, 6, 3> eliminated = mixed * hessian.bottomRightCorner<3, 3>().inverse();
  equations.hessian = hessian.topLeftCorner<6, 6>() - eliminated * mixed.transpose();
  equations.gradient = gradient.head<6>() - eliminated * gradient.tail<3>();
  return equations;
}

}  // namespace

void refine_by_outlines(IcpResult& result, const std::vector<OutlinePoint>& outline,
                        const std::vector<std::vector<OutlinePoint>>& earlier, int num_threads) {
  if (outline.size() < outlines_limits::least_matches || earlier.empty()) return;
  const Pose start = result.target_from_source;
  const double pixel = median_pixel(outline);
  const Matrix6 shape = result.shape_information / outlines_limits::pairs_for_one;
  Vector6 twist = Vector6::Zero();
  OutlineEquations equations;
  for (int iteration = 0; iteration < registration_limits::most_steps; ++iteration) {
    const std::vector<OutlinePoint> edges = moved(outline, motion_about(result.center, twist) * start);
    equations = equations_of(edges, earlier, result.center, pixel, num_threads);
    const double mean_square = equations.squares / static_cast<double>(equations.count);
    const bool lie_on_each_other = std::sqrt(mean_square) <= outlines_limits::largest_rms * pixel || iteration == 0;
    if (equations.count < outlines_limits::least_matches || !lie_on_each_other) return;
    const Vector6 step = -solve_symmetric(equations.hessian + shape, equations.gradient + shape * twist);
    if (!step.allFinite()) return;
    twist += step;
    if (step.head<3>().norm() < 1e-5 && step.tail<3>().norm() < 1e-3 * pixel) break;
  }
  result.target_from_source = motion_about(result.center, twist) * start;
  result.information += equations.hessian;
}

}  // namespace nacre
