// How far registered frames of a recording contradict the model.
#pragma once

#include <algorithm>

#include "depth/limits.hpp"
#include "registration/limits.hpp"

namespace nacre {

// The part of what both sides should see that they see through (1 - consistency): its mean over registered frames,
// which noise, calibration and the scene decide. Until they have told it is as large as where a place is wrong.
class UsualContradiction {
 public:
  void add(double contradiction) {
    count_ = std::min(count_ + 1.0, depth_limits::most_frames);
    mean_ += (contradiction - mean_) / count_;
  }
  double mean() const { return mean_; }

 private:
  friend struct PrivateState;
  double mean_ = registration_limits::wrong_contradiction, count_ = 1.0;  // what is taken for granted counts as a frame
};

}  // namespace nacre
