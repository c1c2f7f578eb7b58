// Loops: the camera comes back to a surface that it has not seen for a while. Where what it sees now and what it saw
// then do not lie on each other, the poses in between are corrected by a pose graph over key frames.
#pragma once

#include <optional>
#include <vector>

#include "loops/key_frames.hpp"
#include "loops/pose_graph.hpp"
#include "registration/acceptance.hpp"

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
  std::vector<Pose> corrections;      // corrected world from the world before, of each frame; empty: none
};

class LoopClosure {
 public:
  // files: where what older key frames saw leaves memory.
  LoopClosure(const Camera& camera, const TrackingOptions& options, ParkedFiles& files)
      : camera_(camera), options_(options), views_(files) {}

  LoopReport add_frame(const LoopFrame& now);
  bool park() { return views_.park(); }
  // The frames have moved, each by its motion.
  void move(const std::vector<Pose>& motions);
  // A tilt of the inverse depth is taken away from all that was seen; the frames move, each by its motion.
  void straighten(double tilt, const std::vector<Pose>& motions);

  // The outlines of the oldest key frames that are near a pose, and verified (world frame).
  std::vector<std::vector<OutlinePoint>> outlines_near(const Pose& pose) const;

  // Where a lost camera is, by keypoints of key frames: of the one that shares most; nothing where none shares enough.
  // turn: of many key frames a part is asked, at each turn another.
  std::optional<Pose> place_by_keypoints(const DepthView& view, std::int64_t turn) const;

  // Of what was last seen by earlier frames it is not known whether it is still in place.
  std::int32_t oldest_frame() const;

  int num_key_frames() const { return static_cast<int>(key_frames_.size()); }

 private:
  friend struct PrivateState;
  // The camera went on by a step of view_distance.
  struct TrajectoryNode {
    std::int32_t frame;
    int key_frame;  // that stands for it
    Pose pose;
  };
  // A key frame, and the part of its surface that is in view of a frame.
  struct SeenKeyFrame {
    int key_frame;
    double part;
  };
  struct SeenKeyFrames {
    std::vector<SeenKeyFrame> verified;  // to lie right
    std::vector<int> in_question;        // those that are seen most
  };
  // A loop: a frame as registered to key frames in question.
  struct Match {
    int key_frame = -1;
    IcpResult alignment;
    double relocalisation_score = 0.0;
    double distance = 0.0;  // [m]
  };

  int time() const { return static_cast<int>(trajectory_.size()); }  // the number of the node to come
  bool is_verified(int key_frame) const;
  const Pose& pose_of(int key_frame) const { return graph_.poses()[static_cast<std::size_t>(key_frame)]; }

  // The steps of add_frame.
  bool is_next_node(const LoopFrame& frame) const;
  SeenKeyFrames select(const LoopFrame& frame) const;
  std::optional<Match> match(const LoopFrame& frame, const FrameCloud& cloud,
                             const std::vector<int>& in_question) const;
  void doubt_all(std::int32_t frame);
  bool insert(const LoopFrame& frame, const FrameCloud& cloud, const std::vector<SeenKeyFrame>& seen, bool is_apart);
  bool comes_around(const std::vector<SeenKeyFrame>& seen) const;
  LoopReport close(const LoopFrame& frame, const Match& loop, const std::vector<int>& in_question);
  LoopReport adjust_loop_of_views(const LoopFrame& frame, const std::vector<SeenKeyFrame>& seen);

  Keypoints keypoints_of(const DepthView& view) const;
  double part_in_view(int key_frame, const LoopFrame& frame) const;
  IcpTarget target_of(const std::vector<int>& key_frames, const AlignOptions& options) const;
  PoseEdge edge(int from, int to, const Pose& pose, const AlignResult& alignment, double depth, bool is_loop) const;
  std::vector<Pose> optimise(const Match& loop, double depth, std::int32_t frame);
  std::vector<Pose> corrections(const std::vector<Pose>& before, std::int32_t num_frames) const;

  const Camera& camera_;
  const TrackingOptions& options_;
  std::vector<KeyFrame> key_frames_;         // nodes of the graph
  KeyFrameViews views_;                      // what each saw
  std::vector<std::vector<int>> seen_with_;  // the earlier key frames in view when one was made, and the later ones
  PoseGraph graph_;
  std::vector<TrajectoryNode> trajectory_;
  std::int32_t first_verified_ = 0;  // the frame that was last registered to the whole model
};

}  // namespace nacre
