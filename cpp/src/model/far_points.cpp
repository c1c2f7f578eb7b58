// What of a model that is partly on disk is needed in memory for a frame, and what is not.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "base/free_memory.hpp"
#include "camera/limits.hpp"
#include "fusion/limits.hpp"
#include "model/pipeline.hpp"
#include "tracking/limits.hpp"

namespace nacre {

void Pipeline::require_whole() const {
  if (torn.empty()) return;
  throw std::filesystem::filesystem_error(
      "the newest frame became part of the model in part alone (" + torn + "): load what was saved before it",
      std::make_error_code(std::errc::io_error));
}

// Before a frame changes anything: where the disk is full, all is as it was.
void Pipeline::make_room() {
  const bool has_parked = loops.park(), has_settled = parked.settle_some();
  if (has_parked || has_settled) give_back_free_memory();
  if (cloud.size() <= options.max_points) return;
  float farthest = 0.0F;
  for (const float z : before.depth) farthest = std::isfinite(z) ? std::max(farthest, z) : farthest;
  const ViewVolume view(camera, before.world_from_camera, tracking_limits::view_margin, spacing,
                        static_cast<double>(farthest));
  parked.park(cloud, blocks, options.max_points, loops.oldest_frame(), view);
  coarsen();
}

// A camera that goes on is registered to points that were seen lately, which have not left. One that is lost is looked
// for in the surface that it would see from where it was, and from where it is guessed to be.
void Pipeline::recall_where_camera_may_be(const FrameExtras& extras) {
  if (frame.valid.empty() || extras.keep_guess || !(was_lost() || extras.guess)) return;
  std::vector<Pose> poses = guesses(extras);
  if (was_lost() && extras.search) {
    for (const Pose& pose : key_poses()) poses.push_back(pose);
  }
  float farthest = 0.0F;
  for (const std::int32_t row : frame.valid) farthest = std::max(farthest, frame.points(row, 2));
  std::vector<ViewVolume> volumes;
  for (const Pose& pose : poses) {
    volumes.emplace_back(camera, pose, tracking_limits::view_margin, spacing, static_cast<double>(farthest));
  }
  parked.recall(cloud, blocks, volumes);
}

// The older surface that newer surface may lie on; see merge_layers.
void Pipeline::recall_layers(std::int32_t oldest_frame) {
  const double reach =
      std::ldexp(spacing, fusion_limits::layer_levels - 1) * std::hypot(1.0, camera_limits::surface_spacings);
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(static_cast<float>(reach));
  std::vector<Box> newer;
  for (const BlockIndex::Summary& block : blocks.summaries()) {
    if (block.newest >= oldest_frame) newer.emplace_back(block.box.min() - margin, block.box.max() + margin);
  }
  parked.recall(cloud, blocks, newer);
}

}  // namespace nacre
