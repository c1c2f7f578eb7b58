#include "depth/restored_depth.hpp"

#include "depth/coarse_depth.hpp"
#include "depth/gaps.hpp"

namespace nacre {
namespace {

DepthImage restore(const DepthRef& measured, const Camera& camera, const DepthUnit& unit, int num_threads) {
  DepthImage restored;
  const bool is_coarse = unit.step > 0.0F;
  if (is_coarse) restored = interpolate_plateaus(measured, unit, num_threads);
  if (has_gaps(measured, camera)) restored = fill_gaps(is_coarse ? DepthRef(restored) : measured, camera);
  return restored;
}

}  // namespace

RestoredDepth::RestoredDepth(const DepthRef& measured, const Camera& camera, int num_threads)
    : unit_(coarse_unit(measured)),
      own_(restore(measured, camera, unit_, num_threads)),
      image_(own_.size() > 0 ? DepthRef(own_) : measured) {}

}  // namespace nacre
