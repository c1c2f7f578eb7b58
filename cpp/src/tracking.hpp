// Where is the camera? Registration of a frame to the model.
#pragma once

#include <vector>

#include "nacre/model.hpp"
#include "surface_observer.hpp"
#include "verdict.hpp"

namespace nacre {

// Tries the guesses (world_from_camera, most trusted first) until one registers the frame; when none does, searches
// around the key poses, unless there are none. `before` is what the camera saw when it was last registered.
TrackingResult track(const PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                     const std::vector<Pose>& guesses, const std::vector<Pose>& key_poses, bool was_lost,
                     const Sight& before, double spacing, const ModelOptions& options);

}  // namespace nacre
