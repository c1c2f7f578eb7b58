// How noisy registered frames are.
#pragma once

namespace nacre {

// What one image shows of a camera's noise is a part of it: errors that neighbouring pixels and successive frames share
// are seen where frames are registered. Their residuals tell how many times larger the whole is.
class ResidualNoise {
 public:
  // residual_sigmas: the scale of a registered frame's residuals, in standard deviations that its image shows.
  void add(double residual_sigmas);
  // By which the standard deviation that an image shows is multiplied: at least 1.
  double factor() const;
  // Whether enough frames have told.
  bool is_known() const;

 private:
  friend struct PrivateState;
  double log_scale_ = 0.0, count_ = 0.0;  // of residual_sigmas, the mean; frames
};

}  // namespace nacre
