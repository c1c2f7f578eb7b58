#include "loops/key_frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/limits.hpp"
#include "camera/limits.hpp"
#include "loops/limits.hpp"

namespace nacre {

Box bounds_of(const Points& points) {
  Box bounds;
  for (Eigen::Index i = 0; i < points.rows(); ++i) bounds.extend(points.row(i).transpose());
  return bounds;
}

FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options) {
  TrackingOptions fewer = options;
  fewer.registration.max_samples = loops_limits::key_frame_points;
  FrameCloud cloud{sample_frame(frame, observer, fewer), 0.0};
  cloud.depth = median_depth(cloud.points);
  return cloud;
}

VisibilityCounts compare(const KeyFrameView& cloud, const Pose& camera_from_cloud, const DepthView& view,
                         const Camera& camera, double margin) {
  return compare(cloud.points, cloud.normals, view, camera_from_cloud.inverse(), camera,
                 {0.0, margin, false, camera_limits::least_facing}, 1);
}

// What is looked at from the side may be farther behind than the margin: see visibility_in.
ViewVolume agreeing_volume(const DepthView& view, const Pose& world_from_camera, const Camera& camera, double margin) {
  const float noise = base_limits::noise_sigmas / camera_limits::least_facing;
  float farthest = 0.0F;
  for (Eigen::Index i = 0; i < view.depth.size(); ++i) {
    farthest = std::max(farthest, view.depth[i]);  // what is not known is not larger
    farthest = std::max(farthest, view.depth[i] + noise * view.sigma[i]);
  }
  const double part = 1.0 - margin / static_cast<double>(camera_limits::least_facing);
  const double limit = part > 0.0 ? static_cast<double>(farthest) / part : std::numeric_limits<double>::infinity();
  return {camera, world_from_camera, 0.0, 0.0, limit};
}

}  // namespace nacre
