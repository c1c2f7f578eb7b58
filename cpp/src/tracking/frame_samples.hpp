// Points of a frame to register it by.
#pragma once

#include "fusion/observer.hpp"
#include "nacre/tracking_options.hpp"
#include "registration/color.hpp"

namespace nacre {

// Denoised points of a frame, spread over it at random: noise would shift the matches on curved surfaces.
struct FrameSamples {
  Points points, normals;  // camera frame
  Values noise;            // standard deviation of each measurement [m]
  Values sigma;            // with what its neighbours are wrong by, too, which no averaging removes [m]
};

// options.registration.max_samples of them, or as many as the frame has.
FrameSamples sample_frame(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options);

// The frame's pixels with their brightness: where there are many, some at random. The observer has colours.
BrightCloud bright_cloud(const Frame& frame, const SurfaceObserver& observer);

}  // namespace nacre
