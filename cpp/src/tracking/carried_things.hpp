// What the camera carries along, in its view: a gripper, a leg of a stand, a finger.
#pragma once

#include <cstdint>
#include <vector>

#include "region/coarse_frame.hpp"

namespace nacre {

// It comes in from the image's border, is nearer than the scene, and stays as it is, depth for depth, while most of the
// rest changes. No pose is asked: what is carried pulls a registration along, as if the camera were at rest.
class CarriedThings {
 public:
  void look_at(const CoarseFrame& cells, const Camera& camera, std::int64_t frame);

  // Of the newest frame, the pixels (1) without those (0) of what is carried; empty: all.
  const MaskImage& scene() const { return scene_; }

  // What the newest frame was the first to show to be carried: its depth in each cell and around it [m], NaN where
  // there is none; empty: nothing. It was carried from a frame on.
  const Values& found() const { return found_; }
  std::int64_t since() const { return since_; }

 private:
  friend struct PrivateState;
  class Pieces;
  bool is_known(const Cell& cell, int i) const { return cell.has_point() && depth_[i] > 0.0F; }
  bool stays(const Cell& cell, int i) const;
  bool most_has_changed(const CoarseFrame& cells, const Pieces& pieces) const;
  void renew(const CoarseFrame& cells, const Pieces& pieces);

  // Of each cell: its depth when most of the image last changed, or since when it is carried [m]; NaN for none.
  Values depth_;
  std::vector<std::uint8_t> is_carried_;
  MaskImage scene_;
  std::int64_t changed_ = 0;  // the frame when most of the image last changed
  Values found_;
  std::int64_t since_ = 0;
};

}  // namespace nacre
