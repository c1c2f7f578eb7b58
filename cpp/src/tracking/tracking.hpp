// Where is the camera? Registration of a frame to the model.
#pragma once

#include <functional>
#include <vector>

#include "fusion/observer.hpp"
#include "nacre/fusion.hpp"
#include "tracking/acceptance.hpp"
#include "tracking/object_view.hpp"
#include "tracking/relocalisation_filter.hpp"

namespace nacre {

// Where the search for a camera that the guesses do not find may go on.
struct WhereElse {
  const std::vector<ObjectView>* views = nullptr;  // of an object that stands on a plane: it may have turned on it
  std::function<std::optional<ObjectView>()> view_of_frame;  // the same of the frame, made when it is needed
  std::function<std::vector<Pose>()> key_poses;              // and around them, likewise
  bool everywhere = false;
};

// Tries the guesses (world_from_camera, most trusted first) until one registers the frame; when none does, searches
// elsewhere. `before` is what the camera saw when it was last registered. Points that were last observed before
// oldest_frame may have drifted away: they are left out, except by the search. Where no single registration is
// convincing, `hypothesis` may become so over several frames.
TrackingResult track(const PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                     const DepthView& now, std::vector<Pose> guesses, const WhereElse& elsewhere, bool was_lost,
                     const DepthView& before, PlaceHypothesis& hypothesis, std::int32_t oldest_frame, double spacing,
                     const TrackingOptions& options);

}  // namespace nacre
