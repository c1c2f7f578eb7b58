// Gaps one pixel wide between pixels of one surface.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// Whether they take a surface apart: cracks, which are rows and columns without a measurement, as in images that were
// moved into a camera with finer pixels; or so many pixels missing at random that the others hang together no more.
bool has_gaps(const DepthRef& depth, const Camera& camera);

// A copy in which they have the mean inverse depth of the two sides (orthographic: the mean depth).
DepthImage fill_gaps(const DepthRef& depth, const Camera& camera);

}  // namespace nacre
