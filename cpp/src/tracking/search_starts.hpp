// Poses (world_from_camera) from which a frame may be registered where its guess is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "depth/depth_view.hpp"
#include "nacre/types.hpp"
#include "registration/icp.hpp"

namespace nacre {

// Around what a known camera saw: it turned about each of its axes, one way and the other, by an angle.
std::vector<Pose> starts_around(const Pose& known, const PointsRef& seen, double angle);

// Beside a known camera, about as far apart as a registration finds its way: it turned about itself, or about what it
// saw.
std::vector<Pose> starts_beside(const Pose& known, const PointsRef& seen);

// Along what a registration leaves open, a gate apart, and as far from a guess as those beside it. depth: of what the
// frame shows [m].
std::vector<Pose> starts_along_open(const IcpResult& found, const Pose& guess, double gate, double depth);

// Where keypoints of the last view say that the camera is; nothing where too few match.
std::optional<Pose> start_by_keypoints(const DepthView& now, const DepthView& last, const Camera& camera, double depth,
                                       std::uint64_t seed, int num_threads);

}  // namespace nacre
