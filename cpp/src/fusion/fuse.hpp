// Fusion with an observer that others use too.
#pragma once

#include <vector>

#include "fusion/image_tiles.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// fuse() of some tiles of the frame, with its observer. Colours are the observer's.
FusionReport fuse_observed(PointModel& model, const RegisteredFrame& now, const ImageTiles& tiles, double spacing,
                           const FusionOptions& options, int num_threads,
                           const std::vector<FrameAttribute>& attributes);

}  // namespace nacre
