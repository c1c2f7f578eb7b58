// The part of the world that a camera can see.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "nacre/camera.hpp"

namespace nacre {

using Box = Eigen::AlignedBox3f;

// Holds what a box holds, moved.
Box moved(const Box& box, const Pose& motion);

// What is before a camera and in its image: bounded by planes. Lens distortion bends those at the sides: such a
// camera's volume is all that is before it.
class ViewVolume {
 public:
  // margin: by how much the image is widened on each side, in parts of it; slack: by how much the volume is, beside
  // what rounding takes [m]; farthest: along the axis [m], may be infinite.
  ViewVolume(const Camera& camera, const Pose& world_from_camera, double margin, double slack, double farthest);

  // Whether a point of a box (world frame) may be in it; false is certain.
  bool may_hold(const Box& box) const;

 private:
  struct Plane {
    Eigen::Vector3d inward;
    double offset;
  };
  std::array<Plane, 6> planes_;
  std::size_t num_planes_ = 0;
  double slack_;
};

}  // namespace nacre
