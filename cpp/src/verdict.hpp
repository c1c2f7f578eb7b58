// Is a registration of a frame right? The verdict rests on what frame and model say about each other, not on ICP's own
// opinion.
#pragma once

#include <limits>
#include <string>

#include "icp_target.hpp"
#include "nacre/model.hpp"

namespace nacre {

struct TrackingResult {
  IcpResult alignment;  // world_from_camera as target_from_source
  // Part of the model's points in view that the frame does not see through, or of the frame's points that the camera
  // did not see through before, whichever is smaller.
  double consistency = 0.0;
  double evidence = 0.0;  // see judge
  FrameStatus status = FrameStatus::lost;
  std::string reason;  // why it is weak or lost
  // Most of the frame matches, closely, and nothing contradicts: no other guess needs to be tried.
  bool is_beyond_doubt = false;
  bool is_to_whole_model = false;  // older points included
  bool is_on_plane = false;        // found by the search on the plane

  // A frame that is not lost before one that is, then by the evidence.
  double rank() const { return (status == FrameStatus::lost ? 0.0 : 1000.0) + evidence; }
};

// What a camera saw from one place.
struct Sight {
  Values depth, sigma;  // of each pixel [m], NaN where nothing was measured
  Pose world_from_camera = Pose::Identity();
};

// Of oriented points that face the camera and project onto a measured pixel: the part that agrees with it, among those
// that agree and those that the camera sees through. Points behind the measured surface are hidden, not wrong. NaN
// where too few of the points can be judged.
double consistency_of(const PointsRef& points, const PointsRef& normals, const Sight& sight, const Camera& camera,
                      double spacing, int num_threads);

// Fills in evidence, status, reason and is_beyond_doubt. The evidence is what the matches tell against chance: for each
// a residual that is small among those that would have matched, ln(0.58 / ratio), where chance gives a ratio of 0.58;
// times overlap^2, since any two surfaces touch somewhere, and consistency^4, since true ones contradict nowhere.
// Strict, for guesses that may be far off: more is asked for.
void judge(TrackingResult& result, const ModelOptions& options, bool strict);

}  // namespace nacre
