#include "loops/loop_closure.hpp"

#include <algorithm>
#include <cmath>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "loops/limits.hpp"
#include "outlines/match.hpp"
#include "registration/icp.hpp"
#include "registration/multiview.hpp"

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

// Between two motions; the pivot goes along a straight line.
Pose blend(const Pose& a, const Pose& b, double part, const Eigen::Vector3d& pivot) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(a.linear()).slerp(part, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  pose.translation() = (1.0 - part) * (a * pivot) + part * (b * pivot) - pose.linear() * pivot;
  return pose;
}

double part_of(std::int64_t count, const FrameCloud& cloud) {
  return static_cast<double>(count) / static_cast<double>(std::max<Eigen::Index>(1, cloud.points.rows()));
}

// The part of a cloud's points that is about where a camera measures something.
double part_in_view(const FrameCloud& cloud, const Pose& camera_from_cloud, const DepthView& view,
                    const Camera& camera) {
  return part_of(compare(cloud, camera_from_cloud, view, camera, loops_limits::search_radius).agreeing, cloud);
}

}  // namespace

bool LoopClosure::is_in_place(int key_frame) const {
  return now() - key_frames_[static_cast<std::size_t>(key_frame)].last_seen <= loops_limits::verified_nodes;
}

std::int32_t LoopClosure::oldest_frame() const {
  if (now() <= loops_limits::verified_nodes) return first_in_place_;
  return std::max(first_in_place_, stops_[static_cast<std::size_t>(now() - 1 - loops_limits::verified_nodes)].frame);
}

std::vector<std::vector<OutlinePoint>> LoopClosure::outlines_near(const Pose& pose) const {
  std::vector<std::vector<OutlinePoint>> outlines;
  for (int k = 0; k < num_key_frames() && outlines.size() < loops_limits::most_near_views; ++k) {
    const KeyFrame& other = key_frames_[static_cast<std::size_t>(k)];
    if (!is_in_place(k) || view_distance(pose_of(k), pose, other.cloud.depth) > loops_limits::near_view) continue;
    if (!other.outline.empty()) outlines.push_back(moved(other.outline, pose_of(k)));
  }
  return outlines;
}

LoopReport LoopClosure::add_frame(const LoopFrame& frame) {
  LoopReport report;
  const Pose& pose = frame.alignment.target_from_source;
  if (!stops_.empty()) {
    const Stop& last = stops_.back();
    const double depth = key_frames_[static_cast<std::size_t>(last.key_frame)].cloud.depth;
    if (!frame.to_whole_model && view_distance(last.pose, pose, depth) < 1.0) return report;
  }
  KeyFrame key{frame.index, sample_cloud(frame.frame, frame.observer, options_), frame.outline, now()};

  // Which key frames' surfaces are in view?
  std::vector<std::pair<double, int>> in_question;
  int nearest = -1, most_seen = -1;
  double least_distance = 1.0, largest_part = 0.0;
  std::vector<int> in_view;
  for (int k = 0; k < num_key_frames(); ++k) {
    KeyFrame& other = key_frames_[static_cast<std::size_t>(k)];
    const double seen = part_in_view(other.cloud, pose.inverse() * pose_of(k), frame.view, camera_);
    if (seen < loops_limits::least_overlap) continue;
    if (!is_in_place(k) && !frame.to_whole_model && !frame.is_given) {
      in_question.emplace_back(-seen, k);
    } else {
      in_view.push_back(k);
    }
  }
  std::sort(in_question.begin(), in_question.end());
  in_question.resize(std::min(in_question.size(), loops_limits::most_candidates));
  std::vector<int> candidates;
  candidates.reserve(in_question.size());
  for (const auto& [part, k] : in_question) candidates.push_back(k);
  std::optional<Match> found = match(frame, key.cloud, candidates);
  const double tolerance = std::max(frame.spacing, static_cast<double>(median_sigma(frame.frame)));
  const bool agrees = found && found->distance <= tolerance;
  if (agrees) in_view.insert(in_view.end(), candidates.begin(), candidates.end());
  if (frame.to_whole_model) {  // how the rest of the model lies to what is in view is not known
    first_in_place_ = frame.index;
    for (KeyFrame& other : key_frames_) other.last_seen = never;
    pending_.reset();
  }
  for (const int k : in_view) {
    key_frames_[static_cast<std::size_t>(k)].last_seen = now();
    const double distance = view_distance(pose_of(k), pose, key.cloud.depth);
    if (distance < least_distance) {
      least_distance = distance;
      nearest = k;
    }
    const FrameCloud& cloud = key_frames_[static_cast<std::size_t>(k)].cloud;
    const double part = part_in_view(cloud, pose.inverse() * pose_of(k), frame.view, camera_);
    if (part > largest_part) {
      largest_part = part;
      most_seen = k;
    }
  }

  // A new view becomes a key frame.
  int node = found && !agrees ? -1 : nearest;
  const bool is_new = node < 0 && key_frames_.size() < loops_limits::most_key_frames;
  if (is_new) {
    const double depth = key.cloud.depth;
    key_frames_.push_back(std::move(key));
    node = graph_.add_node(pose, frame.is_given);
    if (!stops_.empty()) {
      const int from = frame.to_whole_model && most_seen >= 0 ? most_seen : stops_.back().key_frame;
      graph_.add_edge(edge(from, node, pose, frame.alignment, depth, false));
    }
  } else if (node < 0) {
    node = most_seen >= 0 ? most_seen : stops_.back().key_frame;
  }
  stops_.push_back({frame.index, node, pose});
  if (!is_new) return report;

  const bool is_ring = closes_ring(in_view);
  seen_with_.push_back(in_view);
  for (const int k : in_view) seen_with_[static_cast<std::size_t>(k)].push_back(node);
  if (!found) return is_ring ? adjust_ring(frame, in_view) : report;

  found->node = node;
  const double depth = key_frames_.back().cloud.depth;
  if (agrees) {
    graph_.add_edge(edge(found->key_frame, node, found->alignment.target_from_source, found->alignment, depth, true));
    pending_.reset();
    return is_ring ? adjust_ring(frame, in_view) : report;
  }
  const bool is_confirmed =
      pending_ && found->stop - pending_->stop <= 2 &&
      rms_distance(key_frames_.back().cloud.points, found->correction * pose, pending_->correction * pose) <
          std::max(3.0 * tolerance, 0.3 * found->distance);
  if (is_confirmed || found->is_beyond_doubt) {
    report.corrections =
        close(is_confirmed ? std::vector<Match>{*pending_, *found} : std::vector<Match>{*found}, depth, frame.index);
    if (!report.corrections.empty()) {
      report.frame = key_frames_[static_cast<std::size_t>(found->key_frame)].frame;
      report.distance = found->distance;
      report.depth = depth;
      for (const int k : candidates) key_frames_[static_cast<std::size_t>(k)].last_seen = now() - 1;
      pending_.reset();
      return report;
    }
  }
  pending_ = found;
  return report;
}

void LoopClosure::move(const std::vector<Pose>& motions) {
  std::vector<Pose> poses = graph_.poses();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    poses[k] = motions[static_cast<std::size_t>(key_frames_[k].frame)] * poses[k];
  }
  graph_.set_poses(poses);
  for (Stop& stop : stops_) stop.pose = motions[static_cast<std::size_t>(stop.frame)] * stop.pose;
}

// Registers a frame to the clouds of key frames.
std::optional<LoopClosure::Match> LoopClosure::match(const LoopFrame& frame, const FrameCloud& cloud,
                                                     const std::vector<int>& candidates) const {
  if (candidates.empty() || cloud.points.rows() < 100) return std::nullopt;
  Eigen::Index rows = 0;
  for (const int k : candidates) rows += key_frames_[static_cast<std::size_t>(k)].cloud.points.rows();
  Points points(rows, 3), normals(rows, 3);
  rows = 0;
  for (const int k : candidates) {
    const FrameCloud& other = key_frames_[static_cast<std::size_t>(k)].cloud;
    const Eigen::Isometry3f pose(pose_of(k).cast<float>());
    for (Eigen::Index i = 0; i < other.points.rows(); ++i, ++rows) {
      points.row(rows) = (pose * other.points.row(i).transpose()).transpose();
      normals.row(rows) = (pose.linear() * other.normals.row(i).transpose()).transpose();
    }
  }
  AlignOptions align_options = options_.registration;
  align_options.max_samples = align_options.max_points = 0;
  const IcpTarget target(AlignCloud(points, normals), align_options);
  IcpSource source(AlignCloud(cloud.points, cloud.normals, cloud.sigma), align_options);
  const double largest = 0.05 * target.diameter();
  source.reach.resize(source.cloud.points.rows());
  source.largest_residual.resize(source.cloud.points.rows());
  for (Eigen::Index i = 0; i < source.reach.size(); ++i) {
    const double noise = 4.0 * static_cast<double>(cloud.noise[source.cloud.rows[static_cast<std::size_t>(i)]]);
    source.reach[i] = static_cast<float>(std::min(std::max(2.5 * target.spacing(), noise), largest));
    source.largest_residual[i] = static_cast<float>(std::min(std::max(2.75 * frame.spacing, noise), largest));
  }
  align_options.max_distance = loops_limits::search_radius * cloud.depth;
  align_options.final_distance = static_cast<double>(median_of(source.reach));

  Match found;
  found.stop = now();
  found.key_frame = candidates.front();
  found.alignment = align_to(target, source, frame.alignment.target_from_source, align_options);
  const Pose& pose = found.alignment.target_from_source;
  if (found.alignment.status == AlignStatus::too_few_pairs || found.alignment.overlap < loops_limits::least_overlap ||
      found.alignment.weak_directions.cols() > 0 || found.alignment.residual_ratio > loops_limits::largest_ratio) {
    return std::nullopt;
  }
  double seen = 0.0, through = 0.0;
  for (const int k : candidates) {
    const FrameCloud& other = key_frames_[static_cast<std::size_t>(k)].cloud;
    const VisibilityCounts counts =
        compare(other, pose.inverse() * pose_of(k), frame.view, camera_, 2.75 * frame.spacing / cloud.depth);
    seen += part_of(counts.agreeing, other);
    through += part_of(counts.seen_through, other);
  }
  if (seen < loops_limits::least_consistency * (seen + through)) return std::nullopt;
  found.correction = orthonormal(pose * frame.alignment.target_from_source.inverse());
  found.is_beyond_doubt = found.alignment.overlap > 2.0 * loops_limits::least_overlap && through < 0.05 * seen &&
                          found.alignment.residual_ratio < 0.5 * loops_limits::largest_ratio;
  found.distance = rms_distance(cloud.points, pose, frame.alignment.target_from_source);
  return found;
}

// The measured motion between a key frame and a node that was registered at a pose. Beyond what a registration says of
// itself, a step drifts, and a loop is as good as its samples.
PoseEdge LoopClosure::edge(int from, int to, const Pose& pose, const AlignResult& alignment, double depth,
                           bool is_loop) const {
  const bool is_weak = alignment.weak_directions.cols() > 0;
  const double error = is_loop ? loops_limits::loop_error : is_weak ? loops_limits::weak_drift : loops_limits::drift;
  Matrix6 covariance = Matrix6::Zero();
  if (alignment.information.trace() > 0.0) {
    Matrix6 information = alignment.information;
    information.diagonal().array() += 1e-12 * information.trace();
    covariance = loops_limits::covariance_inflation * information.inverse();
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
  const Matrix6 information = about_center.transpose() * covariance.inverse() * about_center;
  return {from, to, pose_of(from).inverse() * pose, information, is_loop};
}

std::vector<Pose> LoopClosure::close(const std::vector<Match>& matches, double depth, std::int32_t frame) {
  const std::vector<Pose> before = graph_.poses();
  const std::size_t num_edges = graph_.edges().size();
  for (const Match& loop : matches) {
    const Pose& pose = loop.alignment.target_from_source;
    graph_.add_edge(edge(loop.key_frame, loop.node, pose, loop.alignment, depth, true));
  }
  const PoseGraphFit fit = graph_.optimise(loops_limits::most_normalized_error);
  const bool is_closed = fit.converged && fit.largest_error <= loops_limits::most_normalized_error &&
                         std::all_of(fit.weights.begin() + static_cast<std::ptrdiff_t>(num_edges), fit.weights.end(),
                                     [](double weight) { return weight > 0.0; });
  if (!is_closed) {
    graph_.drop_edges(num_edges);
    graph_.set_poses(before);
    return {};
  }
  std::vector<Pose> motions = corrections(before, frame + 1);
  for (Stop& stop : stops_) stop.pose = motions[static_cast<std::size_t>(stop.frame)] * stop.pose;
  return motions;
}

// Whether key frames that are all in view now have been tied to each other by a long way only.
bool LoopClosure::closes_ring(const std::vector<int>& in_view) const {
  if (in_view.empty()) return false;
  std::vector<int> steps(seen_with_.size(), -1), queue = {*std::max_element(in_view.begin(), in_view.end())};
  steps[static_cast<std::size_t>(queue.front())] = 0;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const int other : seen_with_[static_cast<std::size_t>(queue[next])]) {
      int& step = steps[static_cast<std::size_t>(other)];
      if (step >= 0) continue;
      step = steps[static_cast<std::size_t>(queue[next])] + 1;
      queue.push_back(other);
    }
  }
  return std::any_of(in_view.begin(), in_view.end(),
                     [&](int k) { return steps[static_cast<std::size_t>(k)] >= loops_limits::least_loop_views; });
}

// A ring of views is closed, and what has drifted is less than would show: the views together determine each other
// better than each did when it was the newest.
LoopReport LoopClosure::adjust_ring(const LoopFrame& frame, const std::vector<int>& in_view) {
  LoopReport report;
  const bool is_weak = frame.alignment.weak_directions.cols() > 0;  // the ring need not determine them either
  if (is_weak || key_frames_.size() > loops_limits::most_loop_views || graph_.has_fixed()) return report;
  std::vector<AdjustableView> views;
  for (int k = 0; k < num_key_frames(); ++k) {
    const FrameCloud& cloud = key_frames_[static_cast<std::size_t>(k)].cloud;
    views.push_back({pose_of(k), cloud.points, cloud.normals});
  }
  const std::vector<Pose> before = graph_.poses();
  const double extent = rms_extent(key_frames_.back().cloud.points);
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
  for (Stop& stop : stops_) stop.pose = report.corrections[static_cast<std::size_t>(stop.frame)] * stop.pose;
  report.frame = key_frames_[static_cast<std::size_t>(in_view.front())].frame;
  const Pose& pose = frame.alignment.target_from_source;
  report.distance = rms_distance(key_frames_.back().cloud.points, report.corrections.back() * pose, pose);
  report.depth = key_frames_.back().cloud.depth;
  return report;
}

// Of each frame: between those of the stops before and after it.
std::vector<Pose> LoopClosure::corrections(const std::vector<Pose>& before, std::int32_t num_frames) const {
  const auto correction_at = [&](const Stop& stop) {
    const auto k = static_cast<std::size_t>(stop.key_frame);
    return orthonormal(graph_.poses()[k] * before[k].inverse());
  };
  std::vector<Pose> motions;
  motions.reserve(static_cast<std::size_t>(num_frames));
  std::size_t next = 0;  // the stop after the frame
  for (std::int32_t i = 0; i < num_frames; ++i) {
    while (next < stops_.size() && stops_[next].frame <= i) ++next;
    const Stop& a = stops_[next > 0 ? next - 1 : 0];
    const Stop& b = stops_[std::min(next, stops_.size() - 1)];
    const double part = b.frame > a.frame
                            ? std::max(0.0, static_cast<double>(i - a.frame) / static_cast<double>(b.frame - a.frame))
                            : 0.0;
    const Eigen::Vector3d pivot =
        a.pose * (key_frames_[static_cast<std::size_t>(a.key_frame)].cloud.depth * Eigen::Vector3d::UnitZ());
    motions.push_back(blend(correction_at(a), correction_at(b), part, pivot));
  }
  return motions;
}

}  // namespace nacre
