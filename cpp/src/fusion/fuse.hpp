// Fusion with an observer that others use too.
#pragma once

#include <vector>

#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// fuse() with the observer of the frame. Colours are the observer's.
FusionReport fuse_observed(PointModel& model, RegisteredFrame now, double spacing, const FusionOptions& options,
                           int num_threads, const std::vector<FrameAttribute>& attributes);

}  // namespace nacre
