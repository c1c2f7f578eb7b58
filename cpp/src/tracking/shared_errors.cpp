#include "tracking/shared_errors.hpp"

#include "tracking/limits.hpp"

namespace nacre {

bool may_stick(const CoarseFrame& cells, const Pose& before_from_now) {
  return mean_pixel_motion(cells, before_from_now) < tracking_limits::sticking_motion;
}

void hold_feigned(const IcpTarget& target, const IcpSource& source, const AlignOptions& options, double least_signal,
                  IcpResult& result) {
  if (result.weak_directions.cols() > 0 || result.signal >= least_signal) return;
  result = align_held(target, source, result.target_from_source, options, {options.weak_threshold, least_signal});
}

}  // namespace nacre
