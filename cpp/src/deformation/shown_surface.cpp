#include "deformation/shown_surface.hpp"

#include <numeric>

#include "camera/point_spacing.hpp"
#include "depth/depth_view.hpp"
#include "fusion/limits.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {

ShownSurface shown_surface(const FrameSamples& samples, const Pose& world_from_camera, const Camera& camera,
                           double spacing) {
  const Eigen::Isometry3f to_world(world_from_camera.cast<float>());
  ShownSurface shown{samples.points, samples.normals, samples.sigma, samples.sigma};
  for (Eigen::Index i = 0; i < shown.points.rows(); ++i) {
    const Eigen::Vector3f point = samples.points.row(i).transpose(), normal = samples.normals.row(i).transpose();
    const float sigma = samples.noise[i];
    shown.points.row(i) = (to_world * point).transpose();
    shown.normals.row(i) = (to_world.linear() * normal).transpose();
    shown.reach[i] = static_cast<float>(largest_offset(spacing_at(point.z(), sigma, camera, spacing), sigma));
  }
  return shown;
}

void add_brightness(ShownSurface& shown, const FrameSamples& samples, const Pose& world_from_camera,
                    const BrightCloud& pixels, double spacing, int num_threads) {
  ColorField field(pixels, samples.points, samples.normals, 4.0 * spacing, num_threads);
  std::vector<std::uint32_t> rows(static_cast<std::size_t>(samples.points.rows()));
  std::iota(rows.begin(), rows.end(), 0U);
  field.fit(rows);
  shown.spacing = spacing;
  shown.brightness.resize(samples.points.rows());
  shown.gradient.resize(samples.points.rows(), 3);
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i) {
    shown.brightness[i] = field.brightness(i);
    shown.gradient.row(i) = (world_from_camera.linear() * field.gradient(i)).transpose().cast<float>();
  }
}

std::vector<std::int32_t> rows_facing(const PointModel& model, const Camera& camera, const Pose& world_from_camera) {
  const PointProjection projection(camera, world_from_camera);
  std::vector<std::int32_t> rows;
  const auto add = [&](Eigen::Index i, const PointProjection::Block& block, int k) {
    if (block.facing[k] > fusion_limits::least_facing) rows.push_back(static_cast<std::int32_t>(i));
  };
  visit_points_in_view(as_rows(model.points), as_rows(model.normals), 0, model.size(), projection, add);
  return rows;
}

}  // namespace nacre
