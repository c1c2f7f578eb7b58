#include "nacre/tracking_report.hpp"

#include <cmath>
#include <limits>

#include "tracking/limits.hpp"

namespace nacre {

double TrackingReport::probability() const {
  using namespace tracking_limits;
  if (!(score > 0.0) && status != FrameStatus::lost) return std::numeric_limits<double>::quiet_NaN();
  if (is_on_plane) return right_on_plane;
  return 1.0 / (1.0 + std::pow(even_odds / score, odds_power));
}

const char* to_string(FrameStatus status) {
  switch (status) {
    case FrameStatus::tracked:
      return "TRACKED";
    case FrameStatus::weak:
      return "WEAK";
    case FrameStatus::relocalised:
      return "RELOCALISED";
    default:
      return "LOST";
  }
}

}  // namespace nacre
