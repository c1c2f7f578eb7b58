#include "depth/restored_depth.hpp"

#include "depth/coarse_depth.hpp"
#include "depth/gaps.hpp"
#include "depth/saturation.hpp"

namespace nacre {

RestoredDepth::RestoredDepth(const DepthRef& measured, const Camera& camera, int num_threads)
    : own_(without_saturated(measured)) {
  const auto newest = [&] { return own_.size() > 0 ? DepthRef(own_) : measured; };
  unit_ = coarse_unit(newest());
  if (unit_.step > 0.0F) own_ = interpolate_plateaus(newest(), unit_, num_threads);
  if (has_gaps(newest(), camera)) own_ = fill_gaps(newest(), camera);
  image_.emplace(newest());
}

}  // namespace nacre
