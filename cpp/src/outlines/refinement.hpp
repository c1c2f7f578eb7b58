// Outlines beside shape: what they say of a pose is added to what pairs of surface points say.
#pragma once

#include "outlines/occluding_edges.hpp"
#include "registration/icp.hpp"

namespace nacre {

// Where what a frame sees is flat, few pairs determine how it lies in its own plane, and they are the worst ones: on
// steep surfaces and at rims. Outlines are rows of the same least squares, for a small motion about the pose that pairs
// have found: the outline of the frame (in its camera's frame) on each of those seen earlier (in the world's). Outlines
// that do not lie on each other leave the pose as it is.
void refine_by_outlines(IcpResult& result, const std::vector<OutlinePoint>& outline,
                        const std::vector<std::vector<OutlinePoint>>& earlier, int num_threads);

}  // namespace nacre
