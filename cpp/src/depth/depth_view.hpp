// Does a depth image confirm points that should be seen there?
#pragma once

#include "nacre/camera.hpp"
#include "nacre/types.hpp"

namespace nacre {

// What a camera saw from one place.
struct DepthView {
  Values depth, sigma;  // of each pixel [m], NaN where nothing was measured
  Pose world_from_camera = Pose::Identity();
  Values measured = {};  // the depth before it was cleaned, 0 or NaN for none; empty: the same
};

// Of oriented points that face a camera at a pose and project onto a pixel that it measured: the part that agrees with
// it, among those that agree and those that the camera sees through. Points behind the measured surface are hidden, not
// wrong. NaN where too few of the points can be judged.
double consistency_of(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                      const Pose& world_from_camera, const Camera& camera, double spacing, int num_threads);

}  // namespace nacre
