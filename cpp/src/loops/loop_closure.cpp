#include "loops/loop_closure.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "depth/tilt.hpp"
#include "keypoints/motion.hpp"
#include "loops/limits.hpp"
#include "outlines/match.hpp"
#include "registration/icp.hpp"
#include "registration/limits.hpp"
#include "registration/multiview.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

constexpr int never = -1000000;

double rms_distance(const Points& points, const Pose& a, const Pose& b) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3d point = points.row(i).transpose().cast<double>();
    sum += (a * point - b * point).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(std::max<Eigen::Index>(1, points.rows())));
}

// About the centroid.
double rms_extent(const Points& points) {
  const Eigen::RowVector3d middle = points.cast<double>().colwise().mean();
  return std::sqrt((points.cast<double>().rowwise() - middle).rowwise().squaredNorm().mean());
}

double part_of(std::int64_t count, const KeyFrameView& view) {
  return static_cast<double>(count) / static_cast<double>(std::max<Eigen::Index>(1, view.points.rows()));
}

// To which surfaces lie on each other.
double tolerance_of(const LoopFrame& frame) {
  return std::max(frame.spacing, static_cast<double>(median_sigma(frame.frame)));
}

}  // namespace

bool LoopClosure::is_verified(int key_frame) const {
  return time() - key_frames_[static_cast<std::size_t>(key_frame)].last_verified <= loops_limits::verified_nodes;
}

// What is around them is as large in all views.
Keypoints LoopClosure::keypoints_of(const DepthView& view) const {
  return find_keypoints(view, camera_, key_frames_.front().depth, options_.num_threads);
}

std::optional<Pose> LoopClosure::place_by_keypoints(const DepthView& view, std::int64_t turn) const {
  if (key_frames_.empty()) return std::nullopt;
  const Keypoints seen = keypoints_of(view);
  if (seen.descriptors.empty()) return std::nullopt;
  const int every = (num_key_frames() + loops_limits::most_asked_key_frames - 1) / loops_limits::most_asked_key_frames;
  std::int64_t most = 0;
  std::optional<Pose> best;
  for (auto k = static_cast<int>(turn % every); k < num_key_frames(); k += every) {
    const auto motion = keypoint_motion(seen, views_[k]->keypoints, options_.registration.seed, options_.num_threads);
    if (!motion || motion->num_matches <= most) continue;
    most = motion->num_matches;
    best = pose_of(k) * motion->target_from_source;
  }
  return best;
}

std::int32_t LoopClosure::oldest_frame() const {
  if (time() <= loops_limits::verified_nodes) return first_verified_;
  const auto node = static_cast<std::size_t>(time() - 1 - loops_limits::verified_nodes);
  return std::max(first_verified_, trajectory_[node].frame);
}

std::vector<std::vector<OutlinePoint>> LoopClosure::outlines_near(const Pose& pose) const {
  std::vector<std::vector<OutlinePoint>> outlines;
  for (int k = 0; k < num_key_frames() && outlines.size() < loops_limits::most_near_views; ++k) {
    const KeyFrame& other = key_frames_[static_cast<std::size_t>(k)];
    if (!is_verified(k) || view_distance(pose_of(k), pose, other.depth) > loops_limits::near_view) continue;
    const auto view = views_[k];
    if (!view->outline.empty()) outlines.push_back(moved(view->outline, pose_of(k)));
  }
  return outlines;
}

LoopReport LoopClosure::add_frame(const LoopFrame& frame) {
  if (!is_next_node(frame)) return {};
  const FrameCloud cloud = sample_cloud(frame.frame, frame.observer, options_);
  auto [seen, in_question] = select(frame);
  std::optional<Match> loop = match(frame, cloud, in_question);
  const bool is_apart = loop && loop->distance > tolerance_of(frame);
  if (loop && !is_apart) {
    for (const int k : in_question) seen.push_back({k, part_in_view(k, frame)});
  }
  if (frame.to_whole_model) doubt_all(frame.index);
  for (const SeenKeyFrame& other : seen) {
    key_frames_[static_cast<std::size_t>(other.key_frame)].last_verified = time();
  }
  if (!insert(frame, cloud, seen, is_apart)) return {};

  const int newest = num_key_frames() - 1;
  const bool is_around = comes_around(seen);
  seen_with_.emplace_back();
  for (const SeenKeyFrame& other : seen) {
    seen_with_.back().push_back(other.key_frame);
    seen_with_[static_cast<std::size_t>(other.key_frame)].push_back(newest);
  }
  if (loop) {
    if (is_apart) return close(frame, *loop, in_question);
    const double depth = key_frames_.back().depth;
    graph_.add_edge(edge(loop->key_frame, newest, loop->alignment.target_from_source, loop->alignment, depth, true));
  }
  return is_around ? adjust_loop_of_views(frame, seen) : LoopReport{};
}

bool LoopClosure::is_next_node(const LoopFrame& frame) const {
  if (trajectory_.empty() || frame.to_whole_model) return true;
  const TrajectoryNode& last = trajectory_.back();
  const double depth = key_frames_[static_cast<std::size_t>(last.key_frame)].depth;
  return !(view_distance(last.pose, frame.alignment.target_from_source, depth) < 1.0);
}

// The part of a key frame's points that is about where the camera measures something.
double LoopClosure::part_in_view(int key_frame, const LoopFrame& frame) const {
  const auto view = views_[key_frame];
  const Pose camera_from_view = frame.alignment.target_from_source.inverse() * pose_of(key_frame);
  return part_of(compare(*view, camera_from_view, frame.view, camera_, camera_limits::view_shift).agreeing, *view);
}

// The key frames whose surfaces are in view.
LoopClosure::SeenKeyFrames LoopClosure::select(const LoopFrame& frame) const {
  SeenKeyFrames seen;
  std::vector<SeenKeyFrame> in_question;
  const ViewVolume volume =
      agreeing_volume(frame.view, frame.alignment.target_from_source, camera_, camera_limits::view_shift);
  for (int k = 0; k < num_key_frames(); ++k) {
    if (!volume.may_hold(moved(key_frames_[static_cast<std::size_t>(k)].bounds, pose_of(k)))) continue;
    const double part = part_in_view(k, frame);
    if (part < loops_limits::least_overlap) continue;
    const bool is_sure = is_verified(k) || frame.to_whole_model || frame.is_given;
    (is_sure ? seen.verified : in_question).push_back({k, part});
  }
  std::stable_sort(in_question.begin(), in_question.end(),
                   [](const SeenKeyFrame& a, const SeenKeyFrame& b) { return a.part > b.part; });
  in_question.resize(std::min(in_question.size(), loops_limits::most_candidates));
  for (const SeenKeyFrame& other : in_question) seen.in_question.push_back(other.key_frame);
  return seen;
}

// How the rest of the model lies to what is in view is not known.
void LoopClosure::doubt_all(std::int32_t frame) {
  first_verified_ = frame;
  for (KeyFrame& other : key_frames_) other.last_verified = never;
}

// Adds the frame to the trajectory; as a key frame, where none stands for it. Returns whether it became one.
bool LoopClosure::insert(const LoopFrame& frame, const FrameCloud& cloud, const std::vector<SeenKeyFrame>& seen,
                         bool is_apart) {
  const Pose& pose = frame.alignment.target_from_source;
  int nearest = -1, most_seen = -1;
  double least_distance = 1.0, largest_part = 0.0;
  for (const SeenKeyFrame& other : seen) {
    const double distance = view_distance(pose_of(other.key_frame), pose, cloud.depth);
    if (distance < least_distance) {
      least_distance = distance;
      nearest = other.key_frame;
    }
    if (other.part > largest_part) {
      largest_part = other.part;
      most_seen = other.key_frame;
    }
  }
  int node = is_apart ? -1 : nearest;
  const bool is_key_frame = node < 0 && key_frames_.size() < loops_limits::most_key_frames;
  if (is_key_frame) {
    const double depth = cloud.depth;
    key_frames_.push_back({frame.index, depth, bounds_of(cloud.points), time()});
    views_.add({cloud.points, cloud.normals, frame.outline, keypoints_of(frame.view)});
    node = graph_.add_node(pose, frame.is_given);
    if (!trajectory_.empty()) {
      const int from = frame.to_whole_model && most_seen >= 0 ? most_seen : trajectory_.back().key_frame;
      graph_.add_edge(edge(from, node, pose, frame.alignment, depth, false));
    }
  } else if (node < 0) {
    node = most_seen >= 0 ? most_seen : trajectory_.back().key_frame;
  }
  trajectory_.push_back({frame.index, node, pose});
  return is_key_frame;
}

// The frame lies elsewhere than it should: corrects all poses, where the loop says enough alone.
LoopReport LoopClosure::close(const LoopFrame& frame, const Match& loop, const std::vector<int>& in_question) {
  LoopReport report;
  if (!PlaceOdds().is_enough(loop.relocalisation_score, Expectation::expected)) return report;
  report.depth = key_frames_.back().depth;
  report.corrections = optimise(loop, report.depth, frame.index);
  if (report.corrections.empty()) return report;
  report.frame = key_frames_[static_cast<std::size_t>(loop.key_frame)].frame;
  report.distance = loop.distance;
  for (const int k : in_question) key_frames_[static_cast<std::size_t>(k)].last_verified = time() - 1;
  return report;
}

void LoopClosure::straighten(double tilt, const std::vector<Pose>& motions) {
  for (int k = 0; k < num_key_frames(); ++k) {
    KeyFrameView view = *views_[k];
    Points &points = view.points, &normals = view.normals;
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const SurfacePoint straight = without_tilt({points.row(i), normals.row(i)}, tilt);
      points.row(i) = straight.point;
      normals.row(i) = straight.normal;
    }
    key_frames_[static_cast<std::size_t>(k)].bounds = bounds_of(points);
    for (OutlinePoint& outline : view.outline) {
      const SurfacePoint straight = without_tilt({outline.point.cast<float>(), outline.normal.cast<float>()}, tilt);
      outline.point = straight.point.cast<double>();
      outline.normal = straight.normal.cast<double>();
      outline.outward = (outline.outward - outline.outward.dot(outline.normal) * outline.normal).normalized();
    }
    for (Eigen::Index i = 0; i < view.keypoints.points.rows(); ++i) {
      auto point = view.keypoints.points.row(i);
      point = without_tilt({point, Eigen::Vector3f::UnitZ()}, tilt).point;
    }
    views_.replace(k, std::move(view));
  }
  move(motions);
  graph_.measure_edges();
}

void LoopClosure::move(const std::vector<Pose>& motions) {
  std::vector<Pose> poses = graph_.poses();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    poses[k] = motions[static_cast<std::size_t>(key_frames_[k].frame)] * poses[k];
  }
  graph_.set_poses(poses);
  for (TrajectoryNode& node : trajectory_) node.pose = motions[static_cast<std::size_t>(node.frame)] * node.pose;
}

// The clouds of key frames as one.
IcpTarget LoopClosure::target_of(const std::vector<int>& key_frames, const AlignOptions& options) const {
  std::vector<std::shared_ptr<const KeyFrameView>> views;
  Eigen::Index rows = 0;
  for (const int k : key_frames) {
    views.push_back(views_[k]);
    rows += views.back()->points.rows();
  }
  Points points(rows, 3), normals(rows, 3);
  rows = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const KeyFrameView& other = *views[k];
    const Eigen::Isometry3f pose(pose_of(key_frames[k]).cast<float>());
    for (Eigen::Index i = 0; i < other.points.rows(); ++i, ++rows) {
      points.row(rows) = (pose * other.points.row(i).transpose()).transpose();
      normals.row(rows) = (pose.linear() * other.normals.row(i).transpose()).transpose();
    }
  }
  return IcpTarget(AlignCloud(points, normals), options);
}

// Registers a frame to key frames. None where nothing speaks for it.
std::optional<LoopClosure::Match> LoopClosure::match(const LoopFrame& frame, const FrameCloud& cloud,
                                                     const std::vector<int>& in_question) const {
  if (in_question.empty() || cloud.points.rows() < base_limits::least_points) return std::nullopt;
  AlignOptions align_options = options_.registration;
  align_options.max_samples = align_options.max_points = 0;
  const IcpTarget target = target_of(in_question, align_options);
  IcpSource source(AlignCloud(cloud.points, cloud.normals, cloud.sigma), align_options);
  const double largest = tracking_limits::largest_reach * target.diameter();
  source.reach.resize(source.cloud.points.rows());
  source.largest_residual.resize(source.cloud.points.rows());
  for (Eigen::Index i = 0; i < source.reach.size(); ++i) {
    const double noise =
        base_limits::noise_sigmas * static_cast<double>(cloud.noise[source.cloud.rows[static_cast<std::size_t>(i)]]);
    const double along = std::max(tracking_limits::reach_spacings * target.spacing(), noise);
    const double across = std::max(camera_limits::surface_spacings * frame.spacing, noise);
    source.reach[i] = static_cast<float>(std::min(along, largest));
    source.largest_residual[i] = static_cast<float>(std::min(across, largest));
  }
  align_options.max_distance = camera_limits::view_shift * cloud.depth;
  align_options.final_distance = static_cast<double>(median_of(source.reach));

  Match found;
  found.key_frame = in_question.front();
  found.alignment = align_to(target, source, frame.alignment.target_from_source, align_options);
  const Pose& pose = found.alignment.target_from_source;
  double seen = 0.0, through = 0.0;
  for (const int k : in_question) {
    const auto other = views_[k];
    const VisibilityCounts counts = compare(*other, pose.inverse() * pose_of(k), frame.view, camera_,
                                            camera_limits::surface_spacings * frame.spacing / cloud.depth);
    seen += part_of(counts.agreeing, *other);
    through += part_of(counts.seen_through, *other);
  }
  const double consistency = seen > 0.0 ? seen / (seen + through) : 0.0;
  found.relocalisation_score =
      accept(found.alignment, {consistency}, Expectation::expected,
             {options_.min_score, true, Consistency{1.0 - registration_limits::wrong_contradiction}})
          .relocalisation_score;
  const bool is_determined = found.alignment.weak_directions.cols() == 0;
  if (!is_determined || !PlaceOdds::is_for(found.relocalisation_score)) return std::nullopt;
  found.distance = rms_distance(cloud.points, pose, frame.alignment.target_from_source);
  return found;
}

// The measured motion between a key frame and a node that was registered at a pose. Beyond what a registration says of
// itself, a step drifts, and a loop is as good as its samples.
PoseEdge LoopClosure::edge(int from, int to, const Pose& pose, const AlignResult& alignment, double depth,
                           bool is_loop) const {
  const double error = is_loop ? loops_limits::loop_error : loops_limits::drift;
  Matrix6 covariance = Matrix6::Zero();
  if (alignment.information.trace() > 0.0) {
    Matrix6 information = alignment.information;
    information.diagonal().array() += 1e-12 * information.trace();
    covariance = loops_limits::covariance_inflation * solve_symmetric_columns(information, Matrix6::Identity());
  }
  covariance.diagonal().head<3>().array() += error * error;
  covariance.diagonal().tail<3>().array() += error * error * depth * depth;
  // A twist of the node about its own origin, seen as one about the registration's centre in the world.
  const Eigen::Vector3d center = alignment.information.trace() > 0.0
                                     ? Eigen::Vector3d(pose.inverse() * alignment.center)
                                     : depth * Eigen::Vector3d::UnitZ();
  Matrix6 about_center = Matrix6::Zero();
  about_center.topLeftCorner<3, 3>() = about_center.bottomRightCorner<3, 3>() = pose.linear();
  about_center.bottomLeftCorner<3, 3>() = -pose.linear() * cross_matrix(center);
  const Matrix6 information =
      about_center.transpose() * solve_symmetric_columns(covariance, Matrix6::Identity()) * about_center;
  return {from, to, pose_of(from).inverse() * pose, information, is_loop};
}

// Poses that agree with the loop, as motions of all frames; none where the graph contradicts it.
std::vector<Pose> LoopClosure::optimise(const Match& loop, double depth, std::int32_t frame) {
  const std::vector<Pose> before = graph_.poses();
  const std::size_t num_edges = graph_.edges().size();
  graph_.add_edge(
      edge(loop.key_frame, num_key_frames() - 1, loop.alignment.target_from_source, loop.alignment, depth, true));
  const PoseGraphFit fit = graph_.optimise(base_limits::noise_sigmas);
  const bool is_closed = fit.converged && fit.largest_error <= base_limits::noise_sigmas &&
                         std::all_of(fit.weights.begin() + static_cast<std::ptrdiff_t>(num_edges), fit.weights.end(),
                                     [](double weight) { return weight > 0.0; });
  if (!is_closed) {
    graph_.drop_edges(num_edges);
    graph_.set_poses(before);
    return {};
  }
  std::vector<Pose> motions = corrections(before, frame + 1);
  for (TrajectoryNode& node : trajectory_) node.pose = motions[static_cast<std::size_t>(node.frame)] * node.pose;
  return motions;
}

// Whether key frames that are all in view now have been tied to each other by a long way only.
bool LoopClosure::comes_around(const std::vector<SeenKeyFrame>& seen) const {
  if (seen.empty()) return false;
  int newest = -1;
  for (const SeenKeyFrame& other : seen) newest = std::max(newest, other.key_frame);
  std::vector<int> steps(seen_with_.size(), -1), queue = {newest};
  steps[static_cast<std::size_t>(queue.front())] = 0;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const int other : seen_with_[static_cast<std::size_t>(queue[next])]) {
      int& step = steps[static_cast<std::size_t>(other)];
      if (step >= 0) continue;
      step = steps[static_cast<std::size_t>(queue[next])] + 1;
      queue.push_back(other);
    }
  }
  return std::any_of(seen.begin(), seen.end(), [&](const SeenKeyFrame& other) {
    return steps[static_cast<std::size_t>(other.key_frame)] >= loops_limits::least_loop_views;
  });
}

// The camera has come around, and what has drifted is less than would show: the views together determine each other
// better than each did when it was the newest.
LoopReport LoopClosure::adjust_loop_of_views(const LoopFrame& frame, const std::vector<SeenKeyFrame>& seen) {
  LoopReport report;
  const bool is_weak = frame.alignment.weak_directions.cols() > 0;  // the views need not determine them either
  if (is_weak || key_frames_.size() > loops_limits::most_loop_views || graph_.has_fixed()) return report;
  std::vector<std::shared_ptr<const KeyFrameView>> kept;
  std::vector<AdjustableView> views;
  for (int k = 0; k < num_key_frames(); ++k) {
    kept.push_back(views_[k]);
    views.push_back({pose_of(k), kept.back()->points, kept.back()->normals});
  }
  const std::vector<Pose> before = graph_.poses();
  const double extent = rms_extent(kept.back()->points);
  const std::vector<Pose> adjusted = adjust_views(views, MotionBasis::all(frame.alignment.center, extent),
                                                  loops_limits::loop_tolerance * frame.spacing,
                                                  options_.registration.weak_threshold, options_.num_threads);
  // The newest was registered to all the others: they may not contradict that.
  const Eigen::Translation3d to_center(-frame.alignment.center);
  const Vector6 twist = log_motion(to_center * (adjusted.back() * before.back().inverse()) * to_center.inverse());
  if (twist.dot(frame.alignment.information * twist) > 6.0 * loops_limits::most_surprise) return report;
  graph_.set_poses(adjusted);
  graph_.measure_edges();
  report.corrections = corrections(before, frame.index + 1);
  for (TrajectoryNode& node : trajectory_) {
    node.pose = report.corrections[static_cast<std::size_t>(node.frame)] * node.pose;
  }
  report.frame = key_frames_[static_cast<std::size_t>(seen.front().key_frame)].frame;
  const Pose& pose = frame.alignment.target_from_source;
  report.distance = rms_distance(kept.back()->points, report.corrections.back() * pose, pose);
  report.depth = key_frames_.back().depth;
  return report;
}

// Of each frame: between those of the nodes before and after it.
std::vector<Pose> LoopClosure::corrections(const std::vector<Pose>& before, std::int32_t num_frames) const {
  const auto correction_at = [&](const TrajectoryNode& node) {
    const auto k = static_cast<std::size_t>(node.key_frame);
    return orthonormal(graph_.poses()[k] * before[k].inverse());
  };
  std::vector<Pose> motions;
  motions.reserve(static_cast<std::size_t>(num_frames));
  std::size_t next = 0;  // the node after the frame
  for (std::int32_t i = 0; i < num_frames; ++i) {
    while (next < trajectory_.size() && trajectory_[next].frame <= i) ++next;
    const TrajectoryNode& a = trajectory_[next > 0 ? next - 1 : 0];
    const TrajectoryNode& b = trajectory_[std::min(next, trajectory_.size() - 1)];
    const double part = b.frame > a.frame
                            ? std::max(0.0, static_cast<double>(i - a.frame) / static_cast<double>(b.frame - a.frame))
                            : 0.0;
    const Eigen::Vector3d pivot =
        a.pose * (key_frames_[static_cast<std::size_t>(a.key_frame)].depth * Eigen::Vector3d::UnitZ());
    motions.push_back(blend(correction_at(a), correction_at(b), part, pivot));
  }
  return motions;
}

}  // namespace nacre
