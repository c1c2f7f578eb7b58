// Fusion with an observer that others use too.
#pragma once

#include <vector>

#include "fusion/block_index.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// fuse() with the observer of the frame, and the index of the model, but for what is removed. Colours are the
// observer's. model_gain: gets what the colours of the model were multiplied by.
FusionReport fuse_observed(PointModel& model, BlockIndex& blocks, RegisteredFrame now, double spacing,
                           const FusionOptions& options, int num_threads, const std::vector<FrameAttribute>& attributes,
                           Eigen::Vector3f* model_gain = nullptr);
// Points that cameras saw through, or looked for in vain, go. Returns a flag for each, 0 where it goes; none if all
// stay.
std::vector<std::uint8_t> remove_violated(PointModel& model, BlockIndex& blocks, const FusionOptions& options,
                                          FusionReport& report);

// Which points thin() keeps: a flag for each.
std::vector<std::uint8_t> thinned(const PointModel& model, double spacing);

}  // namespace nacre
