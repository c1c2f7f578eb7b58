#include "loops/key_frames.hpp"

#include <algorithm>
#include <cmath>

#include "camera/point_projection.hpp"

namespace nacre {

FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options) {
  constexpr int most_points = 3000;
  TrackingOptions fewer = options;
  fewer.registration.max_samples = most_points;
  FrameCloud cloud{sample_frame(frame, observer, fewer), 0.0};
  cloud.depth = median_depth(cloud.points);
  return cloud;
}

CloudInView look_for(const FrameCloud& cloud, const Pose& camera_from_cloud, const Frame& frame, const Camera& camera,
                     double margin) {
  const ModelView view(camera, camera_from_cloud.inverse());
  std::int64_t seen = 0, through = 0;
  ModelView::Block block;
  for (Eigen::Index begin = 0; begin < cloud.points.rows(); begin += ModelView::capacity) {
    const auto count = static_cast<int>(std::min<Eigen::Index>(ModelView::capacity, cloud.points.rows() - begin));
    view.project(cloud.points.data() + 3 * begin, cloud.normals.data() + 3 * begin, count, block);
    for (int i = 0; i < count; ++i) {
      if (!block.inside[i] || !(block.facing[i] > 0.2F)) continue;
      const float behind = frame.points(block.pixel[i], 2) - block.z[i];
      const float tolerance =
          std::max(static_cast<float>(margin) * block.z[i], 4.0F * frame.sigma[block.pixel[i]]) / block.facing[i];
      if (!std::isfinite(behind) || behind < -tolerance) continue;
      ++(behind > tolerance ? through : seen);
    }
  }
  const double all = static_cast<double>(std::max<Eigen::Index>(1, cloud.points.rows()));
  return {static_cast<double>(seen) / all, static_cast<double>(through) / all};
}

}  // namespace nacre
