// Where is the camera? Registration of a frame to the model.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tracking/frame_odometry.hpp"
#include "tracking/frame_registration.hpp"
#include "tracking/object_view.hpp"
#include "tracking/relocalisation_filter.hpp"

namespace nacre {

// Where to look for a camera that the guesses do not find.
struct RelocalisationPlaces {
  const std::vector<ObjectView>* views = nullptr;  // of an object that stands on a plane: it may have turned on it
  std::function<std::optional<ObjectView>()> view_of_frame;  // the same of the frame, made when it is needed
  std::function<std::optional<Pose>()> by_keypoints;         // of earlier views, likewise
  std::function<std::vector<Pose>()> key_poses;              // and around them, likewise
  bool everywhere = false;
  bool beside = false;         // the last guess
  bool beside_if_open = true;  // there also where the guesses explain the frame, but leave directions open
};

// What is known of the camera before the frame is registered.
struct TrackingPrior {
  std::vector<Pose> guesses;  // world_from_camera, most trusted first
  Expectation expectation;    // of the guesses
  bool is_predicted;          // the first guess is where the camera was going, or was given
  bool has_moved;             // two frames or more are registered: it is a recording, not a pair of images
  bool was_lost;              // at the frame before, and searched for
  RelocalisationPlaces elsewhere;
  std::optional<std::vector<Pose>> beside = std::nullopt;       // the places beside the last guess, once they are known
  std::vector<TrackingResult> tried = {};                       // what was found from the guesses and beside them
  std::optional<FrameOdometry::Place> followed = std::nullopt;  // where the frames lead, once it is asked for
  bool guesses_followed = false;                                // it is among the guesses
  double depth = 1.0;                                           // of the frame, the median [m]
};

// Of all places near the guesses that were tried, none of which was believed alone, the one that fits best: where no
// other comes near it.
std::optional<TrackingResult> only_near(const TrackingPrior& prior, const TrackingOptions& options,
                                        const std::optional<Consistency>& usual);

// Tries the guesses until one registers the frame; when none does, searches elsewhere. Where no single registration is
// convincing, that to the frame before may confirm it, or `hypothesis` may become so over several frames. Nowhere is
// the camera believed to be where the frames since it was lost cannot lead.
TrackingResult track(const CurrentFrame& now, const TrackingTarget& target, TrackingPrior& prior,
                     FrameOdometry& odometry, PlaceHypothesis& hypothesis, const TrackingOptions& options);

}  // namespace nacre
