// Fusion with an observer that others use too.
#pragma once

#include <vector>

#include "fusion/block_index.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// fuse() with the observer of the frame, and the index of the model. Colours are the observer's.
FusionReport fuse_observed(PointModel& model, BlockIndex& blocks, RegisteredFrame now, double spacing,
                           const FusionOptions& options, int num_threads,
                           const std::vector<FrameAttribute>& attributes);

}  // namespace nacre
