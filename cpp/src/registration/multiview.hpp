// Views of a surface, all registered to each other at once.
#pragma once

#include <vector>

#include "nacre/registration.hpp"
#include "registration/motion_basis.hpp"

namespace nacre {

struct AdjustableView {
  Pose world_from_camera;
  const Points& points;  // in random order, camera frame
  const Points& normals;
};

// The views' poses after the surfaces of all pairs of views have been brought onto each other (as Lu and Milios 1997 do
// with range scans): points match up to about the tolerance [m]. The first view stays; the others make the motions of
// the basis, except in directions with less information than weak_threshold per pair.
std::vector<Pose> adjust_views(const std::vector<AdjustableView>& views, const MotionBasis& motions, double tolerance,
                               double weak_threshold, int num_threads);

}  // namespace nacre
