// Pixels that hold the largest value that a camera gives, and no measurement: nothing came back, or it was too far.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// Measurements spread over many values. Where the rest of an image does, these are the pixels of the largest value, if
// it is that of a part of the image, fewer pixels come near it, and it is three times the median of the rest. Empty
// where there are none, else a copy in which they are NaN.
DepthImage without_saturated(const DepthRef& depth);

}  // namespace nacre
