// Fusion with an observer that others use too.
#pragma once

#include <vector>

#include "fusion/observer.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// fuse() with the observer of the frame. Colours are the observer's.
FusionReport fuse_observed(PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                           const Pose& world_from_camera, double spacing, std::int32_t frame_index,
                           const FusionOptions& options, int num_threads,
                           const std::vector<FrameAttribute>& attributes = {});

}  // namespace nacre
