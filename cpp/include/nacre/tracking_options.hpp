/// How frames are registered to a model.
#pragma once

#include "nacre/registration.hpp"

namespace nacre {

/// How frames are registered to a model, and which registrations are believed.
struct TrackingOptions {
  AlignOptions registration;
  bool predict_motion = true;   ///< start also from the pose that continues the last motion
  bool relocalise = true;       ///< search where the guesses fail: for an object that turned on its supporting plane,
                                ///< around earlier poses, everywhere
  bool loop_closure = true;     ///< fuse: correct model and poses where the camera comes back to what it saw before
  bool denoise_samples = true;  ///< register surface points averaged over their pixels, not single pixels
  bool verify = true;           ///< accept registrations by their score only
  double min_score = 0.3;       ///< a frame with less is lost; see FrameReport
  int num_threads = 0;          ///< 0: all
};

}  // namespace nacre
