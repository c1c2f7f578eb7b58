// Numbers that decide what the loop does with a frame.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

// clang-format off
namespace nacre::model_limits {

constexpr double coarsening = 1.25;  // [1] budget: of the spacing, when the model reaches its largest size; test_model
constexpr double spacing_pixels = 2.0;  // [pixel] tuned: between points, on the nearer surfaces; bunny12
constexpr std::size_t most_outline_points = 800;  // [points] budget: of a frame's outline, for loops; fandisk12
constexpr std::size_t most_key_poses = 8;  // [poses] budget: that a lost camera is looked for around; test_failure
constexpr std::int64_t search_interval = 4;  // [frames] budget: lost, of which one is searched for around earlier poses, or everywhere; or open, of which one is searched for beside the last pose; or placed by somebody else, of which one is registered to learn from; test_failure
constexpr std::int64_t patience = 8;  // [frames] budget: lost, until the search is made at every so many; test_failure
constexpr std::size_t start_frames = 3;  // [frames] derived: that begin a model anew: two, and one that confirms them; test_starts
constexpr int calibration_interval = 6;  // [views] budget: in new directions, from one calibration of depth to the next; test_depth_calibration
constexpr std::size_t most_object_views = 24;  // [views] budget: of an object that turns on a plane; dog
constexpr double part_in_memory = 0.9;  // [1] budget: of the most points, that are left when points leave; test_parked_points
constexpr std::size_t parcel_points = 8192;  // [points] budget: of a file, of those that leave; test_parked_points
constexpr int settled_parcels = 4;  // [files] budget: a frame, of points that left before a loop closed, that are written anew; test_parked_points
constexpr std::size_t most_kept_motions = 100000;  // [poses] budget: of what happened to points that left, until they are all written anew at once; test_parked_points

}  // namespace nacre::model_limits
// clang-format on
