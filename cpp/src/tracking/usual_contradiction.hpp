// How far registered frames of a recording contradict the model.
#pragma once

#include <algorithm>
#include <optional>

#include "depth/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {

// The part of what both sides should see that they see through (1 - consistency): its mean over registered frames,
// which noise, calibration and the scene decide.
class UsualContradiction {
 public:
  void add(double contradiction) {
    count_ = std::min(count_ + 1.0, depth_limits::most_frames);
    mean_ += (contradiction - mean_) / count_;
  }
  // None until enough frames have told.
  std::optional<double> mean() const {
    return count_ >= tracking_limits::enough_frames ? std::optional<double>(mean_) : std::nullopt;
  }

 private:
  friend struct PrivateState;
  double mean_ = 0.0, count_ = 0.0;
};

}  // namespace nacre
