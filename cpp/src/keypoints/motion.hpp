// How a camera moved between two images, by what both show.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "keypoints/keypoints.hpp"

namespace nacre {

struct KeypointMatch {
  std::int32_t source, target;  // rows
};

// Keypoints that are each other's nearest by what is around them, and clearly so.
std::vector<KeypointMatch> match_keypoints(const Keypoints& source, const Keypoints& target, int num_threads);

struct KeypointMotion {
  Pose target_from_source;
  std::int64_t num_matches;  // that it explains
};

// The rigid motion that most matches agree on (RANSAC, Fischler and Bolles 1981): where a registration may begin. None
// where too few do.
std::optional<KeypointMotion> keypoint_motion(const Keypoints& source, const Keypoints& target, std::uint64_t seed,
                                              int num_threads);

}  // namespace nacre
