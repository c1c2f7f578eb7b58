// An object on its supporting plane, seen from different directions.
#pragma once

#include <vector>

#include "tracking/object_view.hpp"

namespace nacre {

// Whether no view looks in the direction of a camera, and there are few enough for one more.
bool is_new_direction(const std::vector<ObjectView>& views, const Pose& world_from_camera);

// Registers all views to each other at once, moving the object on the plane of the first one. Returns by what each of
// some cameras moves, that of the view that it is nearest to.
std::vector<Pose> adjust(std::vector<ObjectView>& views, const std::vector<Pose>& cameras, int num_threads);

}  // namespace nacre
