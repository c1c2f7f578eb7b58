// Registers one frame to the model, from as many guesses as it takes.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "fusion/observer.hpp"
#include "nacre/fusion.hpp"
#include "outlines/registration.hpp"
#include "region/coarse_frame.hpp"
#include "registration/color.hpp"
#include "tracking/conflicts.hpp"
#include "tracking/frame_samples.hpp"
#include "tracking/points_in_view.hpp"
#include "tracking/still_scene.hpp"
#include "tracking/tracking_result.hpp"

namespace nacre {

// The newest frame.
struct CurrentFrame {
  const Frame& frame;
  const CoarseFrame& cells;
  const Camera& camera;
  const SurfaceObserver& observer;
  const DepthView& view;       // from the origin: where the camera is, is to be found
  const double& noise_factor;  // of what the image shows, that the frame has
};

// What it is registered to.
struct TrackingTarget {
  const PointModel& model;
  const BlockIndex& blocks;    // of the model
  double spacing;              // of the model [m]
  const DepthView& last_view;  // what the camera saw when it was last registered
  const StillScene& still_scene;
  Pose earlier;                      // where the camera was some frames ago
  bool was_open;                     // the newest registered frame left directions open
  std::int32_t oldest_frame;         // points that no later frame has seen may have drifted away: they are left out
  std::optional<Consistency> usual;  // of registered frames: see AcceptanceOptions
};

class FrameRegistration {
 public:
  // Keeps references to its arguments.
  FrameRegistration(const CurrentFrame& now, const TrackingTarget& target, const TrackingOptions& options);

  enum class Gate {
    narrow,  // the guess is about right
    wide,    // it is not
  };
  // expectation: of the guess (world_from_camera), and of what is found near it.
  TrackingResult from(const Pose& guess, Gate gate, Expectation expectation) const;
  // The same from a start beside the guess.
  TrackingResult from(const Pose& start, const Pose& guess, Gate gate, Expectation expectation) const;

  // Of all that frame and model show.
  TrackingResult whole_from(const Pose& start, const Pose& guess, Gate gate, Expectation expectation) const;
  // Where something moves, what stays is registered, too: the better of both tells whether it does.
  TrackingResult without_moving(const TrackingResult& whole, const Pose& guess, Expectation expectation) const;

  // Where something that moves a little pulls the camera along, what is far from it is registered.
  TrackingResult without_pulling(const TrackingResult& found, const Pose& guess, Expectation expectation) const;

  // Whether the camera's motion to a place explains what has changed since the last view, without anything that moved.
  bool explains_change(const Pose& world_from_camera) const;

  // A gate that the user has set is neither narrow nor wide.
  bool has_automatic_gate() const { return !(options_.registration.max_distance > 0.0); }

  void include_older_points();
  // From now on a few points tell whether it is worth while to ask all.
  void ask_few_points_first() { asks_few_first_ = true; }
  const PointsInView& in_view(const Pose& world_from_camera) const;  // of the model
  const IcpSource& source() const { return source_; }
  double depth() const { return depth_; }

  // As far as points are matched at first, from a guess that is about right [m].
  double narrow_gate(const Pose& guess) const;
  // Whether frame and model have colours, and how alike they look from a place.
  bool has_colors() const { return !now_.view.brightness.empty() && !target_.model.colors.empty(); }
  Likeness likeness_at(const Pose& world_from_camera) const;
  // Whether what was found from a guess is nearer to one beside it, and nothing rules those out.
  bool may_be_beside(const TrackingResult& found, const Pose& guess) const;

 private:
  FrameRegistration(const CurrentFrame& now, const TrackingTarget& target, const TrackingOptions& options,
                    const FrameSamples& samples);
  // What is held against each other: all that frame and model show, or what stays where others move.
  struct Surfaces {
    const IcpSource& samples;
    const PointsInView& view;
    double moving;              // part that is left out
    const PointsInView& whole;  // the view, with what is left out: that may be what looks otherwise
  };
  // Both, ready to be matched.
  struct Pairing {
    IcpTarget target;
    IcpSource source;
    AlignOptions options;
  };
  // What stays, as seen from a pose; nothing where nothing moves: moving_things.cpp.
  struct Still {
    IcpSource samples;
    std::vector<std::int32_t> points;  // of the view
    double moving;                     // part that does not
  };
  std::vector<std::uint8_t> shows(const MaskImage& region, const Points& points) const;
  std::optional<Still> still_of(IcpSource samples, std::vector<std::int32_t> points, const PointsInView& view) const;
  std::optional<Still> still_at(const Pose& world_from_camera, const PointsInView& view) const;
  Points conflicts_at(const Pose& world_from_camera, const PointsInView& view) const;
  MaskImage pixels_far_from(const ConflictZones& zones, const Pose& world_from_camera) const;
  std::optional<Still> far_from(const ConflictZones& zones, const Pose& world_from_camera,
                                const PointsInView& view) const;
  double shift_ahead(const Pose& a, const Pose& b) const;
  bool are_close(const Pose& a, const Pose& b) const;
  TrackingResult registered(const Surfaces& surfaces, const Pose& start, const Pose& guess, Gate gate,
                            Expectation expectation) const;
  // What colours or outlines know better than shapes that may be deceived.
  TrackingResult without_doubt(TrackingResult result, const Surfaces& surfaces, const Pairing& pairing,
                               const Pose& start, const Pose& guess, Expectation expectation) const;
  // The best of what is found from places beside it, in the direction of which the shapes tell least.
  TrackingResult best_along_weakest(TrackingResult found, const Surfaces& surfaces, const Pairing& pairing,
                                    const Pose& guess, Expectation expectation) const;
  // Nothing where one side has no colours. The pairing outlives it.
  std::optional<ColorRegistration> colors_of(const PointsInView& view, const Pairing& pairing, IcpSource samples) const;
  bool contradict(const ColorRegistration& colors, const Pairing& pairing, const Pose& pose,
                  const WeakTest& doubt) const;
  // What is found with the directions held that noise may feign, or of which colours tell more; nothing where nothing
  // else decides them.
  std::optional<IcpResult> without_doubtful(const Pairing& pairing, const std::optional<ColorRegistration>& colors,
                                            const Pose& start, const Pose& by_shape, const WeakTest& doubt) const;
  Pairing paired(const Surfaces& surfaces, Gate gate) const;
  TrackingResult test(IcpResult alignment, const Surfaces& surfaces, const Pose& guess, Expectation expectation) const;
  IcpSource gated(IcpSource source, const PointsInView& view, const IcpTarget& target) const;
  void hold_feigned_directions(const Pairing& pairing, IcpResult& result) const;
  void hold_open_directions(const Pairing& pairing, const Pose& guess, IcpResult& result) const;
  IcpResult with_open_decided(const Pairing& pairing, const std::optional<ColorRegistration>& colors,
                              IcpResult open) const;
  Consistency consistency(const Surfaces& surfaces, const Pose& world_from_camera) const;
  Likeness likeness_in(const PointsInView& model, const Pose& world_from_camera) const;
  const OutlinePair& outlines() const;

  CurrentFrame now_;
  TrackingTarget target_;
  const TrackingOptions& options_;
  bool asks_few_first_ = false;
  IcpSource source_;
  Values noise_;  // of the sampled points [m]
  double depth_;  // of the sampled points, the median [m]
  mutable std::optional<std::pair<Pose, PointsInView>> newest_view_;
  // A place whose open directions colours and outlines were asked to decide, before and after.
  struct Decided {
    std::int64_t num_points, num_colors;  // that were registered
    IcpResult open, alignment;
  };
  mutable std::vector<Decided> decided_;
  mutable std::optional<OutlinePair> outlines_;  // found when they are first asked for
};

}  // namespace nacre
