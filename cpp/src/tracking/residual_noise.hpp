// How noisy registered frames are.
#pragma once

#include <cstdint>

namespace nacre {

// What one image shows of a camera's noise is a part of it: errors that neighbouring pixels and successive frames share
// are seen where frames are registered. Their residuals tell how many times larger the whole is.
class ResidualNoise {
 public:
  void add_frame() { ++num_frames_; }  // that is registered
  // residual_sigmas: the scale of its residuals, in standard deviations that its image shows; of one that tells noise.
  void add(double residual_sigmas);
  // By which the standard deviation that an image shows is multiplied: at least 1.
  double factor() const;
  bool has_told() const { return count_ > 0.0; }
  // Whether one has told, and enough have been registered.
  bool is_known() const;

 private:
  friend struct PrivateState;
  double log_scale_ = 0.0, count_ = 0.0;  // of residual_sigmas, the mean; frames that told
  std::int64_t num_frames_ = 0;
};

}  // namespace nacre
