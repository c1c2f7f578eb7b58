// Where a frame was registered to the model, and whether that is believed.
#pragma once

#include <optional>

#include "nacre/tracking_options.hpp"
#include "nacre/tracking_report.hpp"
#include "registration/acceptance.hpp"

namespace nacre {

struct TrackingResult : Acceptance {
  IcpResult alignment;  // world_from_camera as target_from_source
  Consistency consistency = {0.0};
  Expectation expectation = Expectation::expected;  // of where it ended
  double noise_factor = 1.0;                        // of the frame's noise, with which it was found
  double moving = 0.0;                              // part of the frame that moves before the scene, and is left out
  MaskImage still;                                  // which pixels show what stays (1), where that was registered alone
  bool is_to_whole_model = false;                   // older points included
  bool is_on_plane = false;                         // found by the search on the plane

  void test(const TrackingOptions& options, const std::optional<Consistency>& usual) {
    static_cast<Acceptance&>(*this) =
        accept(alignment, consistency, expectation, {options.min_score, options.verify, usual, moving});
  }

  FrameStatus status() const {
    return decision == Decision::rejected       ? FrameStatus::lost
           : decision == Decision::undetermined ? FrameStatus::weak
                                                : FrameStatus::tracked;
  }
  bool is_lost() const { return decision == Decision::rejected; }
  // A frame that is not lost before one that is.
  double rank() const { return is_lost() ? relocalisation_score : 1000.0 + score; }

  TrackingReport report() const {
    return {status(),
            reason,
            alignment.target_from_source,
            alignment.num_inliers,
            alignment.overlap,
            consistency.of_target,
            score,
            alignment.rmse,
            alignment.center,
            alignment.information,
            alignment.weak_directions,
            is_on_plane};
  }
};

}  // namespace nacre
