// A model whose cameras have turned out to be elsewhere.
#pragma once

#include <vector>

#include "nacre/fusion.hpp"

namespace nacre {

// Each point moves with the frame that last observed it. corrections: corrected world from the world before, by frame.
void move_points(PointModel& model, const std::vector<Pose>& corrections, int num_threads);

// Where a point that was last observed before oldest_frame and a later one stand for the same surface, less than a
// spacing apart along it and a thickness across it, they become one.
void merge_layers(PointModel& model, std::int32_t oldest_frame, double spacing, double thickness);

}  // namespace nacre
