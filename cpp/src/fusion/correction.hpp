// A model whose cameras have turned out to be elsewhere.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "nacre/depth_calibration.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Each point moves with the frame that last observed it. corrections: corrected world from the world before, by frame.
void move_points(PointModel& model, const std::vector<Pose>& corrections, int num_threads);

// Each point moves along the ray of the frame that last observed it, whose inverse depth was tilted.
void straighten_points(PointModel& model, const std::vector<Pose>& poses, double tilt, int num_threads);

// Where a point that was last observed before oldest_frame and a later one stand for the same surface, about a spacing
// apart at most, they become one. spacing_of: where a point is, at least the model's spacing and up to eight times it.
// Returns which points are left.
std::vector<std::uint8_t> merge_layers(PointModel& model, std::int32_t oldest_frame, double spacing,
                                       const std::function<double(const Eigen::Vector3f&)>& spacing_of);

}  // namespace nacre
