// Where is the camera? Registration of a frame to the model, and the verdict on it.
#pragma once

#include <string>
#include <vector>

#include "icp_target.hpp"
#include "nacre/model.hpp"
#include "surface_observer.hpp"

namespace nacre {

struct TrackingResult {
  IcpResult alignment;       // world_from_camera as target_from_source
  double consistency = 0.0;  // part of the model's points in view that the frame does not see through
  FrameStatus status = FrameStatus::lost;
  std::string reason;  // why it is weak or lost
  // Most of the frame matches, closely, and nothing contradicts: no other guess needs to be tried.
  bool is_beyond_doubt = false;

  // A frame that is not lost before one that is, then by how much agrees.
  double rank() const { return (status == FrameStatus::lost ? 0.0 : 1.0) + alignment.overlap * consistency; }
};

// Tries the guesses (world_from_camera, most trusted first) until one registers the frame; when none does, searches
// around the key poses, unless there are none.
TrackingResult track(const PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                     const std::vector<Pose>& guesses, const std::vector<Pose>& key_poses, bool was_lost,
                     double spacing, const ModelOptions& options);

}  // namespace nacre
