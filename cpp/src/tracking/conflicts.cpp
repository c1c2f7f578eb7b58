#include "tracking/conflicts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tracking/limits.hpp"

namespace nacre {
namespace {

// Some of the pixels of a view, on a grid.
struct SomePixels {
  Points points;  // of the camera's frame
  Values sigma;   // [m]

  SomePixels(const DepthView& view, const Camera& camera) {
    const double pixels = static_cast<double>(view.depth.size());
    const int step = std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / tracking_limits::most_asked_pixels))));
    const int across = camera.width() / step, down = camera.height() / step;
    points.resize(static_cast<Eigen::Index>(across) * down, 3);
    sigma.resize(points.rows());
    Eigen::Index count = 0;
    for (int v = step / 2; v < step * down; v += step) {
      for (int u = step / 2; u < step * across; u += step) {
        const Eigen::Index pixel = static_cast<Eigen::Index>(v) * camera.width() + u;
        const float z = view.depth[pixel];
        if (!(z > 0.0F)) continue;
        const Ray ray = camera.ray(u, v);
        const float along = z / ray.direction_z;
        points.row(count) << ray.origin_x + along * ray.direction_x, ray.origin_y + along * ray.direction_y, z;
        sigma[count++] = view.sigma[pixel];
      }
    }
    points.conservativeResize(count, 3);
    sigma.conservativeResize(count);
  }
};

}  // namespace

Points seen_through(const PointsRef& points, const PointsRef& normals, const Values& sigma, const DepthView& sight,
                    const Camera& camera, double margin) {
  std::vector<Eigen::Index> rows;
  const PointProjection projection(camera, sight.world_from_camera);
  const VisibilityMargin of_surface{margin, tracking_limits::least_step};
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
  const SomePixels some(view, camera);
  const Eigen::Matrix3f turn = view.world_from_camera.linear().cast<float>();
  const Points points =
      (some.points * turn.transpose()).rowwise() + view.world_from_camera.translation().transpose().cast<float>();
  const Points towards_camera = -(some.points * turn.transpose()).rowwise().normalized();
  return seen_through(points, towards_camera, some.sigma, sight, camera, margin);
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
