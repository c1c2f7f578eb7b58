// Images that were moved into another camera, whose pixels are finer.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// Whether between pixels of one surface there are rows and columns, one pixel wide, without a measurement.
bool has_cracks(const DepthRef& depth, const Camera& camera);

// A copy in which they have the mean inverse depth of the two sides (orthographic: the mean depth).
DepthImage fill_cracks(const DepthRef& depth, const Camera& camera);

}  // namespace nacre
