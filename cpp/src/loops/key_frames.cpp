#include "loops/key_frames.hpp"

#include <algorithm>
#include <cmath>

#include "loops/limits.hpp"

namespace nacre {

FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options) {
  TrackingOptions fewer = options;
  fewer.registration.max_samples = loops_limits::key_frame_points;
  FrameCloud cloud{sample_frame(frame, observer, fewer), 0.0};
  cloud.depth = median_depth(cloud.points);
  return cloud;
}

VisibilityCounts compare(const FrameCloud& cloud, const Pose& camera_from_cloud, const DepthView& view,
                         const Camera& camera, double margin) {
  return compare(cloud.points, cloud.normals, view, camera_from_cloud.inverse(), camera, {0.0, margin, false, 0.2F}, 1);
}

}  // namespace nacre
