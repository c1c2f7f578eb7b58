// Loops: the camera comes back to a surface that it has not seen for a while. Where what it sees now and what it saw
// then do not lie on each other, the poses in between are corrected by a pose graph over key frames.
#pragma once

#include <optional>
#include <vector>

#include "loops/key_frames.hpp"
#include "loops/pose_graph.hpp"
#include "registration/icp.hpp"

namespace nacre {

// A frame that was registered to the model.
struct LoopFrame {
  std::int32_t index;
  const Frame& frame;
  const DepthView& view;
  const SurfaceObserver& observer;
  const std::vector<OutlinePoint>& outline;
  const AlignResult& alignment;  // world_from_camera as target_from_source
  double spacing;                // of the model [m]
  bool is_given;                 // its pose is not to be corrected
  bool to_whole_model;           // registered to all of the model, not to its newer part alone
};

struct LoopReport {
  std::optional<std::int64_t> frame;  // the earlier one that a loop was closed with
  double distance = 0.0;              // between the surfaces before [m], root mean square
  double depth = 0.0;                 // of this frame, the median [m]
  std::vector<Pose> corrections;      // corrected world from the world before, of each frame; empty: all are in place
};

class LoopClosure {
 public:
  LoopClosure(const Camera& camera, const TrackingOptions& options) : camera_(camera), options_(options) {}

  LoopReport add_frame(const LoopFrame& now);
  // The frames have moved, each by its motion.
  void move(const std::vector<Pose>& motions);

  // The outlines of the oldest key frames that are near a pose, and in place (world frame).
  std::vector<std::vector<OutlinePoint>> outlines_near(const Pose& pose) const;

  // Of what was last seen by earlier frames it is not known whether it is still in place.
  std::int32_t oldest_frame() const;

  int num_key_frames() const { return static_cast<int>(key_frames_.size()); }

 private:
  friend struct PrivateState;
  // The camera went on by a step of view_distance.
  struct Stop {
    std::int32_t frame;
    int key_frame;
    Pose pose;
  };
  struct Match {
    int key_frame = -1;
    int node = -1;
    int stop = 0;
    IcpResult alignment;
    Pose correction = Pose::Identity();  // world then from world now
    double distance = 0.0;               // [m]
    bool is_beyond_doubt = false;        // needs no other to confirm it
  };

  int now() const { return static_cast<int>(stops_.size()); }  // the number of the stop to come
  bool is_in_place(int key_frame) const;
  const Pose& pose_of(int key_frame) const { return graph_.poses()[static_cast<std::size_t>(key_frame)]; }
  std::optional<Match> match(const LoopFrame& frame, const FrameCloud& cloud, const std::vector<int>& candidates) const;
  PoseEdge edge(int from, int to, const Pose& pose, const AlignResult& alignment, double depth, bool is_loop) const;
  std::vector<Pose> close(const std::vector<Match>& matches, double depth, std::int32_t frame);
  bool closes_ring(const std::vector<int>& in_view) const;
  LoopReport adjust_ring(const LoopFrame& frame, const std::vector<int>& in_view);
  std::vector<Pose> corrections(const std::vector<Pose>& before, std::int32_t num_frames) const;

  const Camera& camera_;
  const TrackingOptions& options_;
  std::vector<KeyFrame> key_frames_;         // nodes of the graph
  std::vector<std::vector<int>> seen_with_;  // the earlier key frames in view when one was made, and the later ones
  PoseGraph graph_;
  std::vector<Stop> stops_;
  std::int32_t first_in_place_ = 0;  // the frame that was last registered to the whole model
  std::optional<Match> pending_;     // a loop that waits for another to confirm it
};

}  // namespace nacre
