// How far registered frames of a recording and the model contradict each other.
#pragma once

#include <algorithm>
#include <optional>

#include "depth/limits.hpp"
#include "registration/acceptance.hpp"
#include "tracking/limits.hpp"

namespace nacre {

// Its mean over registered frames, which noise, calibration and the scene decide.
class UsualConsistency {
 public:
  void add(const Consistency& consistency) {
    count_ = std::min(count_ + 1.0, depth_limits::most_frames);
    mean_.of_target += (consistency.of_target - mean_.of_target) / count_;
    mean_.of_source += (consistency.of_source - mean_.of_source) / count_;
  }
  // None until enough frames have told.
  std::optional<Consistency> mean() const {
    return count_ >= tracking_limits::enough_frames ? std::optional<Consistency>(mean_) : std::nullopt;
  }

 private:
  friend struct PrivateState;
  Consistency mean_;
  double count_ = 0.0;
};

}  // namespace nacre
