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
    if (consistency.likeness.num_squares == 0.0) return;
    num_alike_ = std::min(num_alike_ + 1.0, depth_limits::most_frames);
    likeness_.agreement += (consistency.likeness.agreement - likeness_.agreement) / num_alike_;
    likeness_.num_squares += (consistency.likeness.num_squares - likeness_.num_squares) / num_alike_;
  }
  // None until enough frames have told.
  std::optional<Consistency> mean() const {
    if (count_ < tracking_limits::enough_frames) return std::nullopt;
    Consistency known = mean_;
    if (num_alike_ >= tracking_limits::enough_frames) known.likeness = likeness_;
    return known;
  }

 private:
  friend struct PrivateState;
  Consistency mean_;  // without the likeness
  double count_ = 0.0;
  Likeness likeness_;
  double num_alike_ = 0.0;
};

}  // namespace nacre
