#include "tracking/frame_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "camera/view_distance.hpp"
#include "registration/acceptance.hpp"
#include "registration/limits.hpp"
#include "tracking/limits.hpp"
#include "tracking/shared_errors.hpp"

namespace nacre {

void FrameOdometry::look_at(const IcpSource& frame) {
  newest_ = Surface{frame.cloud.points, frame.cloud.normals};
  depth_ = median_depth(frame.cloud.points);
}

void FrameOdometry::follow(const IcpSource& frame, const CoarseFrame& cells, const DepthView& view,
                           const Camera& camera, double margin, const std::optional<Consistency>& usual,
                           const TrackingOptions& options) {
  if (is_followed_ || !before_) return;
  is_followed_ = true;
  const IcpTarget target(AlignCloud(before_->points, before_->normals), options.registration);
  IcpResult moved = align_to(target, frame, motion_, options.registration);
  if (may_stick(cells, moved.target_from_source)) {
    hold_feigned(target, frame, options.registration, registration_limits::signal_at_rest, moved);
  }
  if (!(moved.overlap >= tracking_limits::least_followed)) return;
  const double consistency =
      compare(before_->points, before_->normals, view, moved.target_from_source, camera, {margin}, options.num_threads)
          .consistency(tracking_limits::least_judged);
  const auto is_believed = [&](Expectation expectation) {
    return accept(moved, {consistency}, expectation, {options.min_score, true, usual}).decision != Decision::rejected;
  };
  if (is_believed(Expectation::expected)) {
    step_ = Step{moved.target_from_source, moved.weak_directions};
  } else if (is_believed(Expectation::only_near)) {  // near there, but no direction is sure
    step_ = Step{moved.target_from_source, Matrix6::Identity()};
  }
}

void FrameOdometry::Uncertainty::add(double step, const WeakDirections& open, const Eigen::Matrix3d& rotation) {
  const double error = tracking_limits::odometry_error * step;
  shift += open.cols() > 0 ? step : error;
  turn.diagonal().array() += error;
  for (Eigen::Index i = 0; i < open.cols(); ++i) {
    const Eigen::Vector3d axis = rotation * open.col(i).head<3>();
    turn += step * axis * axis.transpose();
  }
}

double FrameOdometry::reach(const Pose& motion) const {
  return std::max({largest_turn_, largest_shift_, view_distance(Pose::Identity(), motion, depth_)});
}

FrameOdometry::Uncertainty FrameOdometry::uncertainty() const {
  Uncertainty sum = path_->uncertainty;
  const bool is_open = step_->weak_directions.cols() > 0;
  const double distance = is_open ? reach(step_->motion) : view_distance(Pose::Identity(), step_->motion, depth_);
  sum.add(distance, step_->weak_directions, path_->world_from_camera.linear());
  return sum;
}

// Over images that show nothing the camera goes on as before; it may be faster than it ever was.
std::optional<FrameOdometry::Path> FrameOdometry::path() const {
  if (!path_) return std::nullopt;
  if (step_) return Path{path_->world_from_camera * step_->motion, uncertainty(), path_->is_seen};
  const bool is_unknown = largest_turn_ == 0.0 && largest_shift_ == 0.0;
  if ((before_ && newest_) || is_unknown) return std::nullopt;
  Path unseen{orthonormal(path_->world_from_camera * motion_), path_->uncertainty, false};
  const auto hidden = [](double largest) {
    return tracking_limits::unseen_speed * std::max(largest, tracking_limits::least_unseen_step);
  };
  unseen.uncertainty.shift += hidden(largest_shift_);
  unseen.uncertainty.turn.diagonal().array() += hidden(largest_turn_);
  return unseen;
}

std::optional<FrameOdometry::Place> FrameOdometry::place() const {
  if (!path_ || !path_->is_seen || !step_) return std::nullopt;
  return Place{path_->world_from_camera * step_->motion, step_->weak_directions.cols() == 0};
}

std::optional<Pose> FrameOdometry::predicted() const {
  if (!path_ || path_->is_seen || before_) return std::nullopt;
  return orthonormal(path_->world_from_camera * motion_);
}

std::optional<Pose> FrameOdometry::motion() const {
  return step_ && step_->weak_directions.cols() == 0 ? std::optional(step_->motion) : std::nullopt;
}

bool FrameOdometry::allows(const Pose& world_from_camera, double margin) const {
  const std::optional<Path> here = path();
  if (!here) return true;
  const Uncertainty& most = here->uncertainty;
  const Eigen::AngleAxisd turn(world_from_camera.linear() * here->world_from_camera.linear().transpose());
  const double shift = (world_from_camera.translation() - here->world_from_camera.translation()).norm();
  return std::abs(turn.angle()) <= camera_limits::view_turn * (margin + turn.axis().dot(most.turn * turn.axis())) &&
         shift <= camera_limits::view_shift * depth_ * (margin + most.shift);
}

void FrameOdometry::end_frame(FrameStatus status, const Pose& world_from_camera,
                              const WeakDirections& weak_directions) {
  const std::optional<Path> here = path(), followed = place() ? here : std::nullopt;
  const std::optional<Path> last = std::exchange(path_, std::nullopt);
  const std::optional<Step> step = std::exchange(step_, std::nullopt);
  const Pose before_it = std::exchange(motion_, Pose::Identity());
  const bool was_tracked = std::exchange(is_tracked_, false);
  is_followed_ = false;
  before_ = std::exchange(newest_, std::nullopt);
  if (status == FrameStatus::lost) {
    path_ = here;
    if (here) motion_ = step ? step->motion : before_it;
    return;
  }
  if (!before_) return;
  is_tracked_ = status != FrameStatus::weak;
  path_ = Path{world_from_camera, {}};
  if (!last || status == FrameStatus::relocalised) return;
  motion_ = orthonormal(last->world_from_camera.inverse() * world_from_camera);
  // Where no step tells what is open, the pose goes on as before, and is wrong by what that changes.
  if (!is_tracked_) {
    const bool is_followed = step && step->weak_directions.cols() == 0;
    path_->uncertainty = followed && is_followed ? followed->uncertainty : last->uncertainty;
    if (!is_followed) path_->uncertainty.add(reach(motion_), weak_directions, Eigen::Matrix3d::Identity());
  } else if (was_tracked) {
    largest_turn_ = std::max(largest_turn_, turn_distance(Pose::Identity(), motion_));
    largest_shift_ = std::max(largest_shift_, shift_distance(Pose::Identity(), motion_, depth_));
  }
}

}  // namespace nacre
