#include "key_frames.hpp"

#include <algorithm>
#include <cmath>

#include "model_view.hpp"
#include "parallel.hpp"
#include "random.hpp"

namespace nacre {

FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, int most_points, int num_threads) {
  const auto num_valid = static_cast<std::int64_t>(frame.valid.size());
  const std::int64_t count = std::min<std::int64_t>(most_points, num_valid);
  FrameCloud cloud{Points(count, 3), Points(count, 3), Values(count)};
  const double stride = static_cast<double>(num_valid) / static_cast<double>(std::max<std::int64_t>(count, 1));
  parallel_blocks(count, ObservationBlock::capacity, num_threads, [&](auto, auto begin, auto end) {
    ObservationBlock block;
    for (std::int64_t i = begin; i < end; ++i) {
      const double place = (static_cast<double>(i) + random_uniform(0, static_cast<std::uint64_t>(i))) * stride;
      const std::int32_t row = frame.valid[std::min(frame.valid.size() - 1, static_cast<std::size_t>(place))];
      cloud.points.row(i) = frame.points.row(row);
      cloud.normals.row(i) = frame.normals.row(row);
      cloud.sigma[i] = frame.sigma[row];
      observer.add(block, cloud.points.row(i).transpose(), cloud.normals.row(i).transpose(), row, frame.sigma[row]);
    }
    observer.observe(block);
    for (std::int64_t i = begin; i < end; ++i) {
      const Observation seen = block[static_cast<int>(i - begin)];
      if (!(seen.weight > 0.0F)) continue;
      cloud.points.row(i) += seen.offset * cloud.normals.row(i);
      cloud.normals.row(i) = seen.normal.normalized().transpose();
    }
  });
  std::vector<float> z(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) z[static_cast<std::size_t>(i)] = cloud.points(i, 2);
  if (count > 0) {
    std::nth_element(z.begin(), z.begin() + count / 2, z.end());
    cloud.depth = static_cast<double>(z[static_cast<std::size_t>(count / 2)]);
  }
  return cloud;
}

double view_distance(const Pose& a, const Pose& b, double depth) {
  constexpr double turn = 0.2, part_of_depth = 0.15;
  const double angle = Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
  return std::max(angle / turn, (a.translation() - b.translation()).norm() / (part_of_depth * depth));
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
