// Where a lost camera may be, when a single frame says too little about it: the best place is followed from frame to
// frame, while nothing is fused, until views that differ have said enough (a sequential test, Wald 1945).
#pragma once

#include <optional>
#include <vector>

#include "registration/correspondences.hpp"
#include "tracking/tracking_result.hpp"

namespace nacre {

class PlaceHypothesis {
 public:
  // Registers a lost frame to the lost one before: where the camera is now (world_from_camera) if the hypothesis is
  // true. None where there is none; where the two frames do not determine the motion it ends.
  std::optional<Pose> predict(const IcpSource& frame, const AlignOptions& options);

  // Whether a registration of the frame that was predicted speaks for the hypothesis.
  bool is_confirmed_by(const TrackingResult& result) const;

  // Takes the best registration of the frame for or against the hypothesis; where it is elsewhere it is a new one.
  // Returns whether there is enough to believe it.
  bool add(const TrackingResult& best, const IcpSource& frame);

  void forget() { *this = {}; }

 private:
  friend struct PrivateState;
  struct Place {
    Pose pose;                // as registered to the model, world_from_camera
    Pose followed;            // as moved from frame to frame since the start
    std::vector<Pose> views;  // that have been counted
    PlaceOdds odds;
  };
  struct Surface {
    Points points, normals;  // camera frame
  };

  bool is_near(const TrackingResult& result) const;

  std::optional<Place> place_;
  std::optional<Surface> before_;   // the lost frame before
  Pose motion_ = Pose::Identity();  // the last: camera before from camera now
  double depth_ = 1.0;              // of the newest frame, the median [m]
};

}  // namespace nacre
