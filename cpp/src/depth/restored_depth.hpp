// A depth image without what its storage did to it: a value for no measurement, rounding to coarse units, and gaps one
// pixel wide.
#pragma once

#include <optional>

#include "nacre/depth.hpp"

namespace nacre {

class RestoredDepth {
 public:
  // The measured depth must stay; it is the image itself where there is nothing to restore.
  RestoredDepth(const DepthRef& measured, const Camera& camera, int num_threads);
  RestoredDepth(const RestoredDepth&) = delete;
  RestoredDepth& operator=(const RestoredDepth&) = delete;

  const DepthRef& image() const { return *image_; }
  // That depth was rounded to, where it shows.
  const DepthUnit& unit() const { return unit_; }

 private:
  DepthUnit unit_;
  DepthImage own_;
  std::optional<DepthRef> image_;
};

}  // namespace nacre
