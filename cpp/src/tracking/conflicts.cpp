#include "tracking/conflicts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "camera/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {

Points seen_through(const PointsRef& points, const PointsRef& normals, const Values& sigma, const DepthView& sight,
                    const Camera& camera, double margin) {
  std::vector<Eigen::Index> rows;
  const PointProjection projection(camera, sight.world_from_camera);
  const VisibilityMargin of_surface{margin, camera_limits::another_surface};
  visit_points_in_view(points, normals, 0, points.rows(), projection,
                       [&](Eigen::Index i, const PointProjection::Block& block, int k) {
                         const float own = sigma.size() > 0 ? sigma[i] : 0.0F;
                         if (visibility_in(sight, block, k, of_surface, own) == Visibility::seen_through)
                           rows.push_back(i);
                       });
  Points found(static_cast<Eigen::Index>(rows.size()), 3);
  for (Eigen::Index i = 0; i < found.rows(); ++i) found.row(i) = points.row(rows[static_cast<std::size_t>(i)]);
  return found;
}

Points seen_through(const DepthView& view, const DepthView& sight, const Camera& camera, double margin) {
  const double pixels = static_cast<double>(view.depth.size());
  const int step = std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / tracking_limits::most_asked_pixels))));
  const Eigen::Matrix3f turn = view.world_from_camera.linear().cast<float>();
  const SeenPoints seen(view, camera, step);
  const Points rays = seen.points * turn.transpose(), towards_camera = -rays.rowwise().normalized();
  const Points points = rays.rowwise() + view.world_from_camera.translation().transpose().cast<float>();
  return seen_through(points, towards_camera, seen.sigma, sight, camera, margin);
}

ConflictZones::ConflictZones(const Points& conflicts, const Eigen::Vector3d& from) {
  struct Crowd {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
  };
  const Points rays = conflicts.rowwise() - from.transpose().cast<float>();
  if (rays.rows() == 0) return;
  const float side = 0.5F * static_cast<float>(tracking_limits::conflict_reach) * rays.rowwise().norm().mean();
  std::map<std::array<int, 3>, Crowd> crowds;
  for (Eigen::Index i = 0; i < rays.rows(); ++i) {
    const auto cell = [&](int axis) { return static_cast<int>(std::floor(rays(i, axis) / side)); };
    Crowd& crowd = crowds[{cell(0), cell(1), cell(2)}];
    crowd.sum += rays.row(i).transpose();
    ++crowd.count;
  }
  for (const auto& [cell, crowd] : crowds) {
    if (crowd.count < tracking_limits::least_conflicts) continue;
    const Eigen::Vector3f ray = crowd.sum / static_cast<float>(crowd.count);
    const float radius = static_cast<float>(tracking_limits::conflict_reach) * ray.norm();
    zones_.push_back({ray + from.cast<float>(), radius * radius});
  }
}

bool ConflictZones::include(const Eigen::Vector3f& point) const {
  return std::any_of(zones_.begin(), zones_.end(),
                     [&](const Zone& zone) { return (point - zone.center).squaredNorm() < zone.squared_radius; });
}

}  // namespace nacre
