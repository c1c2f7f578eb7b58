// Registers one frame to the model, from as many guesses as it takes.
#pragma once

#include <optional>
#include <vector>

#include "fusion/observer.hpp"
#include "nacre/fusion.hpp"
#include "outlines/registration.hpp"
#include "tracking/frame_samples.hpp"
#include "tracking/points_in_view.hpp"
#include "tracking/tracking_result.hpp"

namespace nacre {

// The newest frame.
struct CurrentFrame {
  const Frame& frame;
  const Camera& camera;
  const SurfaceObserver& observer;
  const DepthView& view;       // from the origin: where the camera is, is to be found
  const double& noise_factor;  // of what the image shows, that the frame has
};

// What it is registered to.
struct TrackingTarget {
  const PointModel& model;
  double spacing;              // of the model [m]
  const DepthView& last_view;  // what the camera saw when it was last registered
  std::int32_t oldest_frame;   // points that no later frame has seen may have drifted away: they are left out
  std::optional<double> usual_contradiction;  // of registered frames: see AcceptanceOptions
};

class FrameRegistration {
 public:
  // Keeps references to its arguments.
  FrameRegistration(const CurrentFrame& now, const TrackingTarget& target, const TrackingOptions& options);

  enum class Gate {
    narrow,  // the guess is about right
    wide,    // it is not
  };
  // expectation: of the guess (world_from_camera).
  TrackingResult from(const Pose& guess, Gate gate, Expectation expectation) const;

  // A gate that the user has set is neither narrow nor wide.
  bool has_automatic_gate() const { return !(options_.registration.max_distance > 0.0); }

  void include_older_points() { target_.oldest_frame = 0; }
  const IcpSource& source() const { return source_; }
  double depth() const { return depth_; }

  // Cameras around what a known camera saw: it turned about each of its axes, one way and the other.
  std::vector<Pose> around(const Pose& world_from_camera) const;
  // Cameras beside a known one, about as far apart as a registration finds its way: it turned about itself, or about
  // what it saw.
  std::vector<Pose> beside(const Pose& world_from_camera) const;
  // Whether what was found from a guess is nearer to one beside it, and nothing rules those out.
  bool may_be_beside(const TrackingResult& found, const Pose& guess) const;

 private:
  FrameRegistration(const CurrentFrame& now, const TrackingTarget& target, const TrackingOptions& options,
                    const FrameSamples& samples);
  PointsInView in_view(const Pose& world_from_camera) const;
  IcpSource gated(const PointsInView& view, const IcpTarget& target) const;
  void determine_open_directions(const PointsInView& view, const IcpTarget& target, const IcpSource& gated,
                                 const AlignOptions& options, IcpResult& result) const;
  double consistency(const PointsInView& view, const Pose& world_from_camera) const;
  const OutlinePair& outlines() const;

  CurrentFrame now_;
  TrackingTarget target_;
  const TrackingOptions& options_;
  IcpSource source_;
  Values noise_;                                 // of the sampled points [m]
  double depth_;                                 // of the sampled points, the median [m]
  mutable std::optional<OutlinePair> outlines_;  // found when they are first asked for
};

}  // namespace nacre
