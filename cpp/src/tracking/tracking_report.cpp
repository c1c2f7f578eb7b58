#include "nacre/tracking_report.hpp"

namespace nacre {

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
