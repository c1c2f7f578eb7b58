#include "tracking/object_view.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/limits.hpp"
#include "base/random.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "depth/depth_view.hpp"
#include "region/limits.hpp"
#include "region/support_planes.hpp"
#include "tracking/limits.hpp"

namespace nacre {
std::optional<ObjectView> object_view(const Frame& frame, const MaskImage& region, const SupportPlane& support,
                                      const FrameSamples& samples, std::uint64_t seed) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i) {
    if (samples.points.row(i).allFinite() && samples.normals.row(i).allFinite()) rows.push_back(i);
  }
  if (static_cast<Eigen::Index>(rows.size()) < base_limits::least_points) return std::nullopt;
  for (std::size_t i = rows.size(); i > 1; --i) std::swap(rows[i - 1], rows[random_bits(seed, i) % i]);
  rows.resize(std::min(rows.size(), static_cast<std::size_t>(tracking_limits::most_object_samples)));

  ObjectView view;
  const auto count = static_cast<Eigen::Index>(rows.size());
  view.points.resize(count, 3);
  view.normals.resize(count, 3);
  std::vector<float> errors(rows.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    view.points.row(i) = samples.points.row(row);
    view.normals.row(i) = samples.normals.row(row);
    errors[static_cast<std::size_t>(i)] = std::hypot(base_limits::noise_sigmas * samples.noise[row],
                                                     region_limits::bend * samples.points.row(row).norm());
  }
  view.size = static_cast<double>((view.points.colwise().maxCoeff() - view.points.colwise().minCoeff()).norm());
  view.tolerance =
      std::min(static_cast<double>(median_of(std::move(errors))), tracking_limits::largest_reach * view.size);
  view.depth = frame.points.col(2);
  view.region = region;
  view.support = support;
  return view;
}

Pose ObjectView::ground_frame() const {
  const Eigen::Vector3d middle = points.colwise().mean().transpose().cast<double>();
  Pose camera_from_ground = Pose::Identity();
  const Eigen::Vector3d x = support.normal.unitOrthogonal();
  camera_from_ground.linear() << x, support.normal.cross(x), support.normal;
  camera_from_ground.translation() = middle - (support.normal.dot(middle) - support.offset) * support.normal;
  return camera_from_ground;
}

Eigen::Vector3d ObjectView::center() const {
  Eigen::Vector3d middle = points.colwise().mean().transpose().cast<double>();
  const Eigen::Vector3d level = middle - support.normal.dot(middle) * support.normal;
  if (!(level.norm() > 1e-6 * middle.norm())) return middle;
  const Eigen::Vector3d away = level.normalized(), side = support.normal.cross(away);
  const Eigen::VectorXd across = (points.cast<double>().rowwise() - middle.transpose()) * side;
  return middle + std::sqrt(across.squaredNorm() / static_cast<double>(across.size())) * away;  // a radius
}

ViewAgreement look_at(const ObjectView& moved, const ObjectView& seen, const Pose& seen_from_moved,
                      const Camera& camera, Eigen::Index count) {
  count = std::min(count, moved.points.rows());
  const PointProjection projection(camera, seen_from_moved.inverse());
  const auto tolerance = static_cast<float>(std::max(moved.tolerance, seen.tolerance));
  float agree = 0.0F, through = 0.0F, hidden = 0.0F;
  visit_points_in_view(
      moved.points, moved.normals, 0, count, projection, [&](auto, const PointProjection::Block& block, int i) {
        const float behind = seen.depth[block.pixel[i]] - block.z[i];
        const float margin = 2.0F * tolerance / std::max(block.facing[i], camera_limits::least_facing);
        const Visibility is = visibility(behind, margin);
        if (is == Visibility::unknown) return;
        if (is == Visibility::seen_through) through += 1.0F;
        if (!(block.facing[i] > camera_limits::least_facing) || seen.region.data()[block.pixel[i]] == 0) return;
        if (is == Visibility::occluded) hidden += 1.0F;
        const float ratio = behind * block.facing[i] / tolerance;
        agree += std::max(0.0F, 1.0F - ratio * ratio);
      });
  const auto all = static_cast<double>(std::max<Eigen::Index>(count, 1));
  return {static_cast<double>(agree) / all, static_cast<double>(through) / all, static_cast<double>(hidden) / all};
}

}  // namespace nacre
