// Corners of an image that has brightness and depth, each with what is around it: to be found again in another image.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "depth/depth_view.hpp"
#include "nacre/camera.hpp"
#include "nacre/types.hpp"

namespace nacre {

// 256 comparisons of brightness around a corner (BRIEF, Calonder et al. 2010), about the direction in which it is
// brighter (ORB, Rublee et al. 2011).
using Descriptor = std::array<std::uint64_t, 4>;

int num_differing(const Descriptor& a, const Descriptor& b);

struct Keypoints {
  Points points;  // in the camera's frame [m]
  std::vector<Descriptor> descriptors;
};

// Those of a view, strongest first. What is around them is as large on the surface wherever that is: at `usual_depth`
// [m], keypoints_limits::window_radius. None where the view has no brightness.
Keypoints find_keypoints(const DepthView& view, const Camera& camera, double usual_depth, int num_threads);

}  // namespace nacre
