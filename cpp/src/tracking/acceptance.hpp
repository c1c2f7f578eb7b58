// Is a registration of a frame right? Acceptance rests on what frame and model say about each other, not on ICP's own
// opinion.
#pragma once

#include <limits>
#include <string>

#include "depth/depth_view.hpp"
#include "nacre/tracking_options.hpp"
#include "nacre/tracking_report.hpp"
#include "registration/icp.hpp"

namespace nacre {

// What speaks for a place before a frame is registered there.
enum class Expectation {
  expected,    // near a guess, from the frame before
  near_lost,   // near the last pose, but frames have been lost since
  unexpected,  // far from all guesses
};

struct TrackingResult {
  IcpResult alignment;  // world_from_camera as target_from_source
  // Part of the model's points in view that the frame does not see through, or of the frame's points that the camera
  // did not see through before, whichever is smaller.
  double consistency = 0.0;
  Expectation expectation = Expectation::expected;  // of where it ended
  double score = 0.0;                               // of the registration, see accept_frame
  double relocalisation_score = 0.0;                // see accept_frame
  FrameStatus status = FrameStatus::lost;
  std::string reason;  // why it is weak or lost
  // Most of the frame matches, closely, and nothing contradicts: no other guess needs to be tried.
  bool is_clear_cut = false;
  bool is_to_whole_model = false;  // older points included
  bool is_on_plane = false;        // found by the search on the plane

  TrackingReport report() const;

  // A frame that is not lost before one that is.
  double rank() const { return status == FrameStatus::lost ? relocalisation_score : 1000.0 + score; }
};

// The acceptance test: fills in the scores, status, reason and is_clear_cut. The registration score is what the matches
// tell against chance: for each a residual that is small among those that would have matched, ln(0.58 / ratio), where
// chance gives a ratio of 0.58; times overlap^2, since any two surfaces touch somewhere, and consistency^4, since true
// ones contradict nowhere; by misfit^2 where it is above 1, since a shape that only resembles is bent another way. Far
// from all guesses there are many places that resemble: consistency^8, misfit above half counts, and more is asked for,
// much more of a plane.
//
// The relocalisation score is that of a place that nothing but the frame speaks for. New surface does not speak against
// it (overlap, not its square), contradictions and misfit do the more (consistency^12, misfit^4), and what the
// residuals tell counts as much as the normals agree: see normal_information. Where only a plane of the one fits a
// plane of the other it is 0.
//
// A frame that is clearly larger or smaller than what it fits is lost: its depth is wrong, or it is another thing.
void accept_frame(TrackingResult& result, const TrackingOptions& options);

}  // namespace nacre
