// Another start, where the first frame explains no other: frames in a row that explain each other.
#pragma once

#include <memory>

#include "model/pipeline.hpp"

namespace nacre {

// Keeps the newest frame as long as the model holds a single one, to which weak frames add nothing. Returns the model
// that three frames in a row begin, the newest among them, where they do: its first frame is another one, or its second
// fits the first too little to be believed until the third has confirmed it.
std::unique_ptr<Pipeline> begin_anew(Pipeline& model, const DepthRef& depth, const FrameExtras& extras);

}  // namespace nacre
