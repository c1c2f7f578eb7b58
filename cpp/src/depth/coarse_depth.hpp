// Depth in units that are coarser than its noise: plateaus, and steps between them.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// The unit [m]; 0 where noise hides it.
float coarse_unit(const DepthRef& depth);

// A copy without plateaus, no farther from the depth than half a step between two of them.
DepthImage interpolate_plateaus(const DepthRef& depth, float unit, int num_threads);

// The noise of depth that was rounded to a unit.
NoiseModel with_unit(const NoiseModel& noise, float unit);

}  // namespace nacre
