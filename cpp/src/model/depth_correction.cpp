// The depth of a camera turns out to be systematically wrong: the views so far say by how much, and what is known is
// corrected, later images as they come.
#include <algorithm>

#include "base/se3.hpp"
#include "depth/limits.hpp"
#include "depth/tilt.hpp"
#include "fusion/correction.hpp"
#include "model/limits.hpp"
#include "model/pipeline.hpp"

namespace nacre {
namespace {

// Of every frame, from those of some frames: between two of them in proportion.
std::vector<Pose> interpolated(const std::vector<Pose>& corrections, const std::vector<std::int32_t>& frames,
                               const std::vector<Pose>& poses) {
  std::vector<Pose> all;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const auto after = std::lower_bound(frames.begin(), frames.end(), static_cast<std::int32_t>(k));
    const auto next = static_cast<std::size_t>(after - frames.begin());
    if (after == frames.end() || next == 0) {
      all.push_back(corrections[std::min(next, corrections.size() - 1)]);
      continue;
    }
    const double part = static_cast<double>(static_cast<std::int32_t>(k) - frames[next - 1]) /
                        static_cast<double>(frames[next] - frames[next - 1]);
    all.push_back(blend(corrections[next - 1], corrections[next], part, poses[k].translation()));
  }
  return all;
}

void straighten_view(DepthView& view, const Camera& camera, double tilt, int num_threads) {
  for (Values* values : {&view.depth, &view.measured}) {
    const Eigen::Map<const DepthImage> image(values->data(), camera.height(), camera.width());
    const DepthImage straight = correct_depth(image, camera, tilt, num_threads);
    *values = Eigen::Map<const Values>(straight.data(), straight.size());
  }
}

}  // namespace

std::vector<Pose> Pipeline::depth_view_poses() const {
  std::vector<Pose> poses;
  for (const std::int32_t k : depth_view_frames) poses.push_back(history.pose(static_cast<std::size_t>(k)));
  return poses;
}

std::optional<DepthCalibration> Pipeline::depth_calibration() const {
  if (!depth_views) return std::nullopt;
  DepthCalibrator calibrator = *depth_views;
  calibrator.set_poses(depth_view_poses());
  DepthCalibration found = calibrator.fit(options.num_threads);
  found.tilt += options.depth.tilt;
  return found;
}

// From time to time, when the camera has looked in new directions. A frame has time for an iteration over as many views
// as there will be at most, or for more over fewer. Where each looks in a direction of its own few would be left to
// correct: the first that can tell does.
void Pipeline::calibrate_depth(FrameReport& report) {
  if (!depth_views) return;
  const Eigen::Map<const DepthImage> seen(before.depth.data(), camera.height(), camera.width());
  depth_views->set_poses(depth_view_poses());
  const bool is_view = depth_views->add(seen, report.world_from_camera);
  const bool is_sparse = is_view && !depth_view_frames.empty() && depth_view_frames.back() == report.index - 1;
  if (is_view) depth_view_frames.push_back(static_cast<std::int32_t>(report.index));
  if (is_view && depth_views->num_views() % model_limits::calibration_interval == 0) depth_views->begin_fit();
  const int most_steps =
      is_sparse ? depth_limits::most_calibration_steps : depth_limits::most_views / depth_views->num_views();
  for (int i = 0; i < most_steps && depth_views->is_fitting(); ++i) {
    std::optional<DepthCalibration> found = depth_views->step(options.num_threads);
    if (!found) continue;
    const double corrected = options.depth.tilt - given.depth.tilt;
    found->tilt += corrected;
    if (found->is_significant()) straighten(found->tilt - corrected, report);
  }
}

void Pipeline::straighten(double tilt, FrameReport& report) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < history.size(); ++i) poses.push_back(history.pose(i));
  poses.push_back(report.world_from_camera);
  const std::vector<Pose> straight = depth_views->correct(tilt, options.num_threads);
  std::vector<Pose> corrections;
  for (std::size_t i = 0; i < straight.size(); ++i) {
    corrections.push_back(straight[i] * poses[static_cast<std::size_t>(depth_view_frames[i])].inverse());
  }
  corrections = interpolated(corrections, depth_view_frames, poses);
  straighten_points(cloud, poses, tilt, options.num_threads);
  parked.straighten(poses, tilt);
  move_all(corrections, report);
  loops.straighten(tilt, corrections);
  straighten_view(before, camera, tilt, options.num_threads);
  before.world_from_camera = report.world_from_camera;
  still_scene = StillScene(camera);
  options.depth.tilt += tilt;
}

}  // namespace nacre
