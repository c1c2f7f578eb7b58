#include "tracking/frame_odometry.hpp"

#include <algorithm>

#include "camera/view_distance.hpp"
#include "registration/acceptance.hpp"
#include "registration/icp.hpp"
#include "tracking/limits.hpp"

namespace nacre {

void FrameOdometry::look_at(const IcpSource& frame) {
  newest_ = Surface{frame.cloud.points, frame.cloud.normals};
  depth_ = median_depth(frame.cloud.points);
}

void FrameOdometry::follow(const IcpSource& frame, const DepthView& view, const Camera& camera, double margin,
                           const TrackingOptions& options) {
  if (is_followed_ || !before_) return;
  is_followed_ = true;
  const IcpTarget target(AlignCloud(before_->points, before_->normals), options.registration);
  const IcpResult moved = align_to(target, frame, motion_, options.registration);
  if (!(moved.overlap >= tracking_limits::least_followed)) return;
  const double consistency =
      compare(before_->points, before_->normals, view, moved.target_from_source, camera, {margin}, options.num_threads)
          .consistency(tracking_limits::least_judged);
  const Acceptance acceptance = accept(moved, consistency, Expectation::expected, {options.min_score, true, {}});
  if (acceptance.decision == Decision::rejected) return;
  const double distance = view_distance(Pose::Identity(), moved.target_from_source, depth_);
  const bool is_determined = moved.weak_directions.cols() == 0;
  step_ = Step{moved.target_from_source,
               is_determined ? tracking_limits::odometry_error * distance : std::max(distance, largest_step_),
               is_determined};
}

std::optional<FrameOdometry::Place> FrameOdometry::place() const {
  if (!path_ || !step_) return std::nullopt;
  return Place{path_->world_from_camera * step_->motion, path_->uncertainty + step_->uncertainty, step_->is_determined};
}

std::optional<Pose> FrameOdometry::motion() const {
  return step_ && step_->is_determined ? std::optional(step_->motion) : std::nullopt;
}

bool FrameOdometry::allows(const Pose& world_from_camera) const {
  const std::optional<Place> here = place();
  return !here || view_distance(here->world_from_camera, world_from_camera, depth_) <= 1.0 + here->uncertainty;
}

void FrameOdometry::end_frame(FrameStatus status, const Pose& world_from_camera) {
  const std::optional<Path> last = std::exchange(path_, std::nullopt);
  const std::optional<Step> step = std::exchange(step_, std::nullopt);
  const bool was_tracked = std::exchange(is_tracked_, false);
  is_followed_ = false;
  before_ = std::exchange(newest_, std::nullopt);
  motion_ = Pose::Identity();
  if (!before_) return;
  if (status == FrameStatus::lost) {
    if (!step) return;
    motion_ = step->motion;
    if (last) path_ = Path{last->world_from_camera * motion_, last->uncertainty + step->uncertainty};
    return;
  }
  is_tracked_ = status != FrameStatus::weak;
  path_ = Path{world_from_camera, 0.0};
  if (!last || status == FrameStatus::relocalised) return;
  motion_ = last->world_from_camera.inverse() * world_from_camera;
  const double distance = view_distance(Pose::Identity(), motion_, depth_);
  // Where directions are open the pose goes on as before, and is wrong by what that changes.
  if (!is_tracked_) path_->uncertainty = last->uncertainty + std::max(distance, largest_step_);
  if (was_tracked && is_tracked_) largest_step_ = std::max(largest_step_, distance);
}

}  // namespace nacre
