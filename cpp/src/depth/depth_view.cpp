#include "depth/depth_view.hpp"

#include <limits>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "depth/systematic_error.hpp"

namespace nacre {

Eigen::RowVector3f point_at(const DepthView& view, const Camera& camera, int u, int v) {
  const Ray ray = camera.ray(u, v);
  const float z = view.depth[static_cast<Eigen::Index>(v) * camera.width() + u], along = z / ray.direction_z;
  return {ray.origin_x + along * ray.direction_x, ray.origin_y + along * ray.direction_y, z};
}

SeenPoints::SeenPoints(const DepthView& view, const Camera& camera, int step) {
  const int across = camera.width() / step, down = camera.height() / step;
  points.resize(static_cast<Eigen::Index>(across) * down, 3);
  sigma.resize(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const int u = static_cast<int>(i % across) * step + step / 2, v = static_cast<int>(i / across) * step + step / 2;
    points.row(i) = point_at(view, camera, u, v);
    sigma[i] = view.sigma[static_cast<Eigen::Index>(v) * camera.width() + u];
  }
}

void VisibilityCounts::add(Visibility visibility) {
  agreeing += visibility == Visibility::agrees;
  seen_through += visibility == Visibility::seen_through;
  occluded += visibility == Visibility::occluded;
}

VisibilityCounts& VisibilityCounts::operator+=(const VisibilityCounts& other) {
  agreeing += other.agreeing;
  seen_through += other.seen_through;
  occluded += other.occluded;
  return *this;
}

double VisibilityCounts::consistency(std::int64_t least) const {
  const std::int64_t judged = agreeing + seen_through;
  return judged >= least ? static_cast<double>(agreeing) / static_cast<double>(judged)
                         : std::numeric_limits<double>::quiet_NaN();
}

Visibility visibility_in(const DepthView& view, const PointProjection::Block& block, int i,
                         const VisibilityMargin& margin, float sigma) {
  if (!(block.facing[i] > margin.least_facing)) return Visibility::unknown;
  const std::int32_t pixel = block.pixel[i];
  const float measured = view.depth[pixel];
  const float systematic = margin.with_systematic_error ? systematic_error(measured) : 0.0F;
  const float noise_squared =
      base_limits::noise_sigmas * base_limits::noise_sigmas * (view.sigma[pixel] * view.sigma[pixel] + sigma * sigma);
  const float surface = static_cast<float>(margin.distance) + static_cast<float>(margin.part_of_depth) * block.z[i];
  const float error = std::sqrt(noise_squared + systematic * systematic);
  return visibility(measured - block.z[i], std::max(surface, error) / block.facing[i]);
}

VisibilityCounts compare(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                         const Pose& points_from_camera, const Camera& camera, const VisibilityMargin& margin,
                         int num_threads, const Values& sigma) {
  const PointProjection projection(camera, points_from_camera);
  return block_reduce(points.rows(), PointProjection::capacity, num_threads, VisibilityCounts{},
                      [&](std::int64_t begin, std::int64_t end) {
                        VisibilityCounts counts;
                        visit_points_in_view(points, normals, begin, end - begin, projection,
                                             [&](auto row, const PointProjection::Block& block, int i) {
                                               const float own = sigma.size() > 0 ? sigma[row] : 0.0F;
                                               counts.add(visibility_in(view, block, i, margin, own));
                                             });
                        return counts;
                      });
}

}  // namespace nacre
