// What stands still, and what moves before it.
#pragma once

#include <vector>

#include "depth/depth_view.hpp"
#include "region/coarse_frame.hpp"

namespace nacre {

// The scene as the camera saw it from a place that it has not left yet, coarsely: a pixel of its view is a cell. What
// stands now where the camera saw through has moved in; what it sees through now has moved away.
class StillScene {
 public:
  explicit StillScene(const Camera& camera);
  static CoarseFrame cells_of(const Frame& frame, const Camera& camera);
  static Camera camera_of_cells(const Camera& camera);

  // The pixels of a frame that show the scene (1), without those (0) of things that have moved in. A thing holds
  // together, is not where the scene was seen, and is large: errors at edges and of poses are narrow. Empty where
  // nothing has. margin: of a surface [m], beside the noise.
  MaskImage still_region(const CoarseFrame& cells, const Pose& world_from_camera, double margin) const;

  // The newest registered frame, of which `still` shows the scene (empty: all of it).
  void add(const CoarseFrame& cells, const MaskImage& still, const Pose& world_from_camera, double margin);
  // Whether something moved before it in the newest registered frame.
  bool is_passed() const { return !moved_.empty(); }
  // The world has moved.
  void move(const Pose& motion);

 private:
  friend struct PrivateState;
  double part_in_view(const CoarseFrame& cells, const Pose& world_from_camera) const;
  void forget_what_left(const DepthView& now, double margin);

  int width_, height_;               // of images [pixels]
  Camera camera_;                    // whose pixels are cells
  DepthView scene_;                  // the still one
  DepthView all_;                    // what was seen there and then
  std::vector<std::uint8_t> moved_;  // which cells of the newest frame; empty: none
};

// Of oriented points of a world that a view shows, those that do not belong to things that have moved away: large ones
// that the camera sees through now.
std::vector<std::int32_t> still_points(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                                       const Pose& world_from_camera, const Camera& camera, double margin);

}  // namespace nacre
