// How the camera moves from frame to frame. Where it is lost this tells where it may be, and where the model alone says
// too little of a place, whether the frame before leads there, too.
#pragma once

#include <optional>

#include "depth/depth_view.hpp"
#include "nacre/tracking_options.hpp"
#include "nacre/tracking_report.hpp"
#include "registration/correspondences.hpp"

namespace nacre {

class FrameOdometry {
 public:
  // Where the frames lead.
  struct Place {
    Pose world_from_camera;
    double uncertainty;  // how far from there the camera may be, in view distances
    bool is_determined;  // the last step left no direction open
  };

  // The newest frame: at each, before it is followed.
  void look_at(const IcpSource& frame);
  // Registers the newest frame to the one before, once. margin: across a surface [m].
  void follow(const IcpSource& frame, const DepthView& view, const Camera& camera, double margin,
              const TrackingOptions& options);
  // The newest frame is done with: it is registered there, or lost.
  void end_frame(FrameStatus status, const Pose& world_from_camera);

  // Of the newest frame; none where the frames since the camera was last registered could not be followed.
  std::optional<Place> place() const;
  // The newest frame's motion, camera before from camera now; none where it is not determined.
  std::optional<Pose> motion() const;
  // Whether the camera can have come to a place.
  bool allows(const Pose& world_from_camera) const;

 private:
  friend struct PrivateState;
  struct Surface {
    Points points, normals;  // camera frame
  };
  struct Path {
    Pose world_from_camera;
    double uncertainty;
  };
  struct Step {
    Pose motion;
    double uncertainty;
    bool is_determined;
  };

  std::optional<Surface> before_;   // the frame before
  std::optional<Path> path_;        // up to it
  bool is_tracked_ = false;         // whether it was
  Pose motion_ = Pose::Identity();  // that led to it
  double largest_step_ = 0.0;       // between tracked frames
  // Of the newest frame.
  std::optional<Surface> newest_;
  std::optional<Step> step_;
  bool is_followed_ = false;
  double depth_ = 1.0;  // the median [m]
};

}  // namespace nacre
