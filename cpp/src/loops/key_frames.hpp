// Key frames: a few views that stand for all, each with samples of the surface that it saw, and with its outline.
#pragma once

#include <cstdint>

#include "camera/view_distance.hpp"
#include "camera/view_volume.hpp"
#include "depth/depth_view.hpp"
#include "loops/key_frame_views.hpp"
#include "tracking/frame_samples.hpp"

namespace nacre {

struct FrameCloud : FrameSamples {
  double depth;  // the median [m]
};
FrameCloud sample_cloud(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options);

// What is kept in memory of each.
struct KeyFrame {
  std::int32_t frame;  // its number
  double depth;        // the median [m]
  Box bounds;          // of the points of its view
  int last_verified;   // the last node of the trajectory from which its surface was seen to lie right
};

Box bounds_of(const Points& points);

// What a camera says of another one's points: of so much of the depth as margin it counts as the same place.
VisibilityCounts compare(const KeyFrameView& cloud, const Pose& camera_from_cloud, const DepthView& view,
                         const Camera& camera, double margin);

// Where points of a cloud are that may agree then.
ViewVolume agreeing_volume(const DepthView& view, const Pose& world_from_camera, const Camera& camera, double margin);

}  // namespace nacre
