// How noisy registered frames are.
#pragma once

#include <cstdint>

namespace nacre {

// What one image shows of a camera's noise is a part of it: errors that neighbouring pixels and successive frames share
// are seen where frames are registered. Their residuals tell how many times larger the whole is.
class ResidualNoise {
 public:
  // A frame that is registered. residual_sigmas: the scale of its residuals, in standard deviations that its image
  // shows. Until a frame tells noise, those that do not are all there is to learn from.
  void add(double residual_sigmas, bool tells);
  // By which the standard deviation that an image shows is multiplied: at least 1.
  double factor() const;
  bool has_told() const { return has_told_; }
  // Whether one has told, and enough have been registered.
  bool is_known() const;

 private:
  friend struct PrivateState;
  double log_scale_ = 0.0, count_ = 0.0;  // of residual_sigmas, the mean; of so many frames
  bool has_told_ = false;
  std::int64_t num_frames_ = 0;
};

}  // namespace nacre
