// Where a lost camera may be, when a single frame says too little about it: the best place is followed from frame to
// frame, while nothing is fused, until views that differ have said enough (a sequential test, Wald 1945).
#pragma once

#include <optional>
#include <vector>

#include "tracking/tracking_result.hpp"

namespace nacre {

class PlaceHypothesis {
 public:
  // Where the camera is now (world_from_camera) if the hypothesis is true, by its motion since the frame before (camera
  // before from camera now). None where there is no hypothesis; where there is no motion it ends.
  std::optional<Pose> predict(const std::optional<Pose>& motion);

  // Whether a registration of the frame that was predicted speaks for the hypothesis.
  bool is_confirmed_by(const TrackingResult& result) const;

  // Takes the best registration of a frame, of a median depth [m], for or against the hypothesis; where it is elsewhere
  // it is a new one. Returns whether there is enough to believe it.
  bool add(const TrackingResult& best, double depth);

  void forget() { *this = {}; }

 private:
  friend struct PrivateState;
  struct Place {
    Pose pose;                // as registered to the model, world_from_camera
    Pose followed;            // as moved from frame to frame since the start
    std::vector<Pose> views;  // that have been counted
    PlaceOdds odds;
  };

  bool is_near(const TrackingResult& result) const;

  std::optional<Place> place_;
  double depth_ = 1.0;  // of the newest frame, the median [m]
};

}  // namespace nacre
