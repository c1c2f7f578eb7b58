// A model that bends: its canonical shape, and how it is at every frame.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "deformation/warp_field.hpp"
#include "deformation/warp_registration.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Between frames the model is in its canonical shape, in the course of one it is as the camera sees it: bend() and
// unbend() take it there and back.
class DeformingShape {
 public:
  bool has_nodes() const { return !field_.nodes.empty(); }
  std::size_t num_nodes() const { return field_.nodes.size(); }
  double strain() const { return field_.strain(); }

  void bend(PointModel& model, int num_threads);
  // Bends a model that is bent on, until it lies on what a frame shows.
  WarpFit follow(PointModel& model, const std::vector<std::int32_t>& in_view, const ShownSurface& shown,
                 int num_threads);
  // Where follow() left the shape as it was: as the frame would have it. Returns whether that is another.
  bool follow_at_any_rate(PointModel& model, int num_threads);
  bool is_bent() const { return is_bent_; }  // otherwise than at the frame before
  // As it was at the frame before.
  void go_back(PointModel& model, int num_threads);
  void keep(const std::vector<std::uint8_t>& flags);  // see PointModel::keep
  // What was observed of the bent model changes its canonical shape; what was added gets nodes. spacing_of: of the
  // points at a depth [m].
  void unbend(PointModel& model, const Pose& world_from_camera, double spacing,
              const std::function<float(float)>& spacing_of, std::int32_t frame, int num_threads);
  void end_frame();  // the next

  // Points and normals of a model in its canonical shape, and nodes, as they were at a frame.
  WarpField field_at(std::size_t frame) const { return field_.as_of(states_[frame]); }
  std::size_t num_frames() const { return states_.size(); }

 private:
  friend struct PrivateState;
  std::vector<std::uint8_t> was_bending() const;  // each node, at the newest frame that has ended
  void show(PointModel& model, int num_threads);

  WarpField field_;
  bool is_bent_ = false;
  std::vector<WarpNode> nodes_before_, nodes_bent_;  // empty: as the field has them
  OrientedPoints canonical_, bent_;                  // in the course of a frame
  std::vector<NodeStates> states_;                   // of each frame
};

}  // namespace nacre
