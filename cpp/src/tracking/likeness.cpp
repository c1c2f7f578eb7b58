#include "tracking/likeness.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tracking/limits.hpp"

namespace nacre {
namespace {

// Of pairs of values.
class Moments {
 public:
  void add(double a, double b) {
    ++count_;
    sum_ += Eigen::Vector2d(a, b);
    squares_ += Eigen::Vector2d(a, b) * Eigen::Vector2d(a, b).transpose();
  }
  int count() const { return count_; }
  Eigen::Matrix2d covariance() const {
    const Eigen::Vector2d mean = sum_ / count_;
    return squares_ / count_ - mean * mean.transpose();
  }

 private:
  int count_ = 0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares_ = Eigen::Matrix2d::Zero();
};

}  // namespace

Likeness likeness(const PointsInView& model, const DepthView& view, const Pose& world_from_camera, const Camera& camera,
                  const VisibilityMargin& margin, int side) {
  if (model.brightness.size() == 0 || view.brightness.empty()) return {};
  const int across = camera.width() / side + 1, down = camera.height() / side + 1;
  std::vector<Moments> squares(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  const auto look = [&](Eigen::Index point, const PointProjection::Block& block, int i) {
    if (!std::isfinite(model.brightness[point])) return;
    if (visibility_in(view, block, i, margin) != Visibility::agrees) return;
    const std::int32_t pixel = block.pixel[i];
    const int u = pixel % camera.width(), v = pixel / camera.width();
    squares[static_cast<std::size_t>(v / side * across + u / side)].add(
        static_cast<double>(model.brightness[point]), view.brightness[static_cast<std::size_t>(pixel)]);
  };
  visit_points_in_view(model.points, model.normals, 0, model.points.rows(), PointProjection(camera, world_from_camera),
                       look);
  std::vector<Eigen::Matrix2d> told;
  Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
  for (const Moments& square : squares) {
    if (square.count() < tracking_limits::least_in_square) continue;
    told.push_back(square.covariance());
    mean += told.back();
  }
  mean /= std::max(1.0, static_cast<double>(told.size()));
  double sum = 0.0, sum_squared = 0.0;
  for (const Eigen::Matrix2d& own : told) {
    const double variances = (own(0, 0) + mean(0, 0)) * (own(1, 1) + mean(1, 1));
    const double correlation = variances > 0.0 ? own(0, 1) / std::sqrt(variances) : 0.0;
    sum += correlation;
    sum_squared += correlation * correlation;
  }
  if (!(sum_squared > 0.0)) return {};
  const auto count = static_cast<double>(told.size());
  return {std::min(1.0, sum / std::sqrt(count * sum_squared)), count};
}

}  // namespace nacre
