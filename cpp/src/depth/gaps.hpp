// Gaps one pixel wide between pixels of one surface: nothing is measured there, or something that belongs to no surface
// around it.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// Whether more than one is in each window that noise is measured on: rows and columns without a measurement, as in
// images that were moved into a camera with finer pixels, or pixels missing or wrong at random.
bool has_gaps(const DepthRef& depth, const Camera& camera);

// A copy in which they have the mean inverse depth of the two sides (orthographic: the mean depth).
DepthImage fill_gaps(const DepthRef& measured, const Camera& camera);

}  // namespace nacre
