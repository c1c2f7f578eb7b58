// Isolated pixels and small components.
#pragma once

#include "depth/byte_image.hpp"
#include "depth/inverse_depth_image.hpp"
#include "nacre/depth.hpp"

namespace nacre {

// Drops kept pixels (1) with more than max_missing of their 5 x 5 neighbours missing.
void remove_isolated(double max_missing, int num_threads, ByteImage& keep);

// Drops kept pixels (1) in 4-connected components of fewer than min_component pixels; neighbours are connected when the
// surface between them is not steeper than max_slant.
void remove_speckles(const PlanarImage& image, const NoiseModel& noise, const DepthOptions& options, int num_threads,
                     ByteImage& keep);

}  // namespace nacre
