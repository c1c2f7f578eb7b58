#include "tracking/search_starts.hpp"

#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "camera/view_distance.hpp"
#include "keypoints/motion.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

Eigen::Vector3d middle_of(const PointsRef& points) { return points.colwise().mean().transpose().cast<double>(); }

}  // namespace

std::vector<Pose> starts_around(const Pose& known, const PointsRef& seen, double angle) {
  std::vector<Pose> starts = {known};
  if (seen.rows() == 0) return starts;
  const Eigen::Vector3d center = middle_of(seen);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double turned : {-angle, angle}) {
      Pose turn = Pose::Identity();
      turn.linear() = Eigen::AngleAxisd(turned, known.linear().col(axis)).toRotationMatrix();
      turn.translation() = center - turn.linear() * center;
      starts.push_back(turn * known);
    }
  }
  return starts;
}

std::vector<Pose> starts_beside(const Pose& known, const PointsRef& seen) {
  std::vector<Pose> starts;
  if (seen.rows() == 0) return starts;
  const int most = static_cast<int>(camera_limits::new_direction / tracking_limits::beside_turn);
  for (const Eigen::Vector3d& center : {Eigen::Vector3d(known.translation()), middle_of(seen)}) {
    for (int i = -most; i <= most; ++i) {
      for (int j = -most; j <= most; ++j) {
        for (int k = -most; k <= most; ++k) {
          const Eigen::Vector3d turn = tracking_limits::beside_turn * Eigen::Vector3d(i, j, k);
          if (turn.norm() == 0.0 || turn.norm() > camera_limits::new_direction) continue;
          Vector6 motion = Vector6::Zero();
          motion.head<3>() = turn;
          starts.push_back(motion_about(center, motion) * known);
        }
      }
    }
  }
  return starts;
}

std::vector<Pose> starts_along_open(const IcpResult& found, const Pose& guess, double gate, double depth) {
  const double farthest = 2.0 * camera_limits::new_direction / camera_limits::view_turn;
  std::vector<Pose> starts;
  for (Eigen::Index i = 0; i < found.weak_directions.cols(); ++i) {
    Vector6 direction = found.weak_directions.col(i);
    direction.head<3>() /= found.extent;
    for (const double side : {-1.0, 1.0}) {
      for (int step = 1; step <= tracking_limits::most_open_steps; ++step) {
        const Pose start = motion_about(found.center, side * step * gate * direction) * found.target_from_source;
        if (view_distance(guess, start, depth) > farthest) break;
        starts.push_back(start);
      }
    }
  }
  return starts;
}

std::optional<Pose> start_by_keypoints(const DepthView& now, const DepthView& last, const Camera& camera, double depth,
                                       std::uint64_t seed, int num_threads) {
  if (last.brightness.empty()) return std::nullopt;
  const auto keypoints_of = [&](const DepthView& view) { return find_keypoints(view, camera, depth, num_threads); };
  const auto motion = keypoint_motion(keypoints_of(now), keypoints_of(last), seed, num_threads);
  return motion ? std::optional(last.world_from_camera * motion->target_from_source) : std::nullopt;
}

}  // namespace nacre
