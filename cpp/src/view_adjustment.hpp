// Views of an object on a plane, all registered to each other at once.
#pragma once

#include <vector>

#include "object_view.hpp"

namespace nacre {

// The views' poses (world_from_camera) after the surfaces of all pairs of views have been brought onto each other (as
// Lu and Milios 1997 do with range scans). The first stays; the others turn about the plane's normal and move across
// it.
std::vector<Pose> adjust_views(const std::vector<ObjectView>& views, int num_threads);

}  // namespace nacre
