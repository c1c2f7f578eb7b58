// How the camera moves from frame to frame. Where it is lost this tells where it may be, and where the model alone says
// too little of a place, whether the frame before leads there, too.
#pragma once

#include <optional>

#include "depth/depth_view.hpp"
#include "nacre/tracking_options.hpp"
#include "nacre/tracking_report.hpp"
#include "region/coarse_frame.hpp"
#include "registration/acceptance.hpp"
#include "registration/correspondences.hpp"

namespace nacre {

class FrameOdometry {
 public:
  using WeakDirections = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  // Where the frames lead.
  struct Place {
    Pose world_from_camera;
    bool is_determined;  // the last step left no direction open
  };

  // The newest frame: at each, before it is followed.
  void look_at(const IcpSource& frame);
  // Registers the newest frame to the one before, once. margin: across a surface [m]; usual: of registered frames.
  void follow(const IcpSource& frame, const CoarseFrame& cells, const DepthView& view, const Camera& camera,
              double margin, const std::optional<Consistency>& usual, const TrackingOptions& options);
  // The newest frame is done with: it is registered there, or lost. weak_directions: as AlignResult has them.
  void end_frame(FrameStatus status, const Pose& world_from_camera, const WeakDirections& weak_directions);

  // Of the newest frame; none where the frames since the camera was last registered could not be followed.
  std::optional<Place> place() const;
  // Where the camera is, if it went on as before over images that showed nothing; none elsewhere.
  std::optional<Pose> predicted() const;
  // The newest frame's motion, camera before from camera now; none where it is not determined.
  std::optional<Pose> motion() const;
  // Whether no image showed nothing since the camera was last registered.
  bool is_seen() const { return !path_ || path_->is_seen; }
  // Whether the camera can have come to a place, as far as frames and a margin tell, in view distances.
  bool allows(const Pose& world_from_camera, double margin = 1.0) const;

 private:
  friend struct PrivateState;
  struct Surface {
    Points points, normals;  // camera frame
  };
  // How far a camera may be from where it is thought to be, in view distances: its turns about each axis of the world,
  // or of the frame before, add up apart, since a wall that leaves shifts open still tells which way the camera looks.
  struct Uncertainty {
    double shift = 0.0;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();

    void add(double step, const WeakDirections& open, const Eigen::Matrix3d& rotation);
  };
  struct Path {
    Pose world_from_camera;
    Uncertainty uncertainty;
    bool is_seen = true;  // no image of it showed nothing
  };
  struct Step {
    Pose motion;
    WeakDirections weak_directions;
  };
  std::optional<Path> path() const;  // up to the newest frame
  Uncertainty uncertainty() const;   // of the newest frame's place
  // Of a motion, as long as it is, or as ever between tracked frames where directions are open.
  double reach(const Pose& motion) const;

  std::optional<Surface> before_;   // the frame before
  std::optional<Path> path_;        // up to it
  bool is_tracked_ = false;         // whether it was
  Pose motion_ = Pose::Identity();  // that led to it
  // Between tracked frames, in view distances.
  double largest_turn_ = 0.0, largest_shift_ = 0.0;
  // Of the newest frame.
  std::optional<Surface> newest_;
  std::optional<Step> step_;
  bool is_followed_ = false;
  double depth_ = 1.0;  // the median [m]
};

}  // namespace nacre
