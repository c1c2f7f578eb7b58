// Key frames: a few views that stand for all, each with samples of the surface that it saw, and with its outline.
#pragma once

#include <cstdint>

#include "camera/view_distance.hpp"
#include "outlines/occluding_edges.hpp"
#include "tracking/frame_samples.hpp"

namespace nacre {

struct FrameCloud : FrameSamples {
  double depth;  // the median [m]
};
FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options);

struct KeyFrame {
  std::int32_t frame;  // its number
  FrameCloud cloud;
  std::vector<OutlinePoint> outline;  // camera frame
  int last_seen;  // the last stop of the camera where its surface was in view and known to be in place
};

// What a frame says about points whose place is known about.
struct CloudInView {
  double seen = 0.0;     // part of the points that are where the frame measures something
  double through = 0.0;  // part of them that it sees through
};

// margin: of the depth, that counts as the same place.
CloudInView look_for(const FrameCloud& cloud, const Pose& camera_from_cloud, const Frame& frame, const Camera& camera,
                     double margin);

}  // namespace nacre
