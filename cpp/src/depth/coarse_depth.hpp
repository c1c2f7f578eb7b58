// Depth in units that are coarser than its noise: plateaus, and steps between them.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

DepthUnit coarse_unit(const DepthRef& depth);

// A copy without plateaus, no farther from the depth than half a step between two of them.
DepthImage interpolate_plateaus(const DepthRef& depth, const DepthUnit& unit, int num_threads);

// The noise of depth that was rounded to a unit.
NoiseModel with_unit(const NoiseModel& noise, const DepthUnit& unit);

}  // namespace nacre
