// Numbers that decide when a loop closes.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>
#include <cstdint>

#include "nacre/types.hpp"

// clang-format off
namespace nacre::loops_limits {

constexpr int key_frame_points = 3000;  // [points] budget: of the surface that a key frame keeps; test_loop_closure
constexpr std::size_t most_key_frames = 1000;  // [views] budget: about 90 kB each, 130 with keypoints, in memory or on disk; test_loop_closure
constexpr std::size_t newest_key_frames = 32;  // [views] budget: that stay in memory where older ones may leave; test_key_frame_views
constexpr std::size_t recalled_key_frames = 32;  // [views] budget: of those on disk, that are in memory too; test_key_frame_views
constexpr int most_asked_key_frames = 30;  // [views] budget: whose keypoints a lost frame is compared with at once; test_keypoints
constexpr std::size_t most_candidates = 4;  // [views] budget: that a frame is registered to at once; test_loop_closure
constexpr int verified_nodes = 12;  // [nodes] tuned: of the trajectory: what was seen since is taken to be in place; test_loop_closure, teddy
constexpr double least_overlap = 0.3;  // [1] tuned: of a frame and a key frame; test_loop_closure
constexpr double drift = 0.005;  // [rad, depth] tuned: standard deviation of a step between nodes; test_loop_closure
constexpr double loop_error = 0.25 * drift;  // [rad, depth] tuned: standard deviation of a registration that closes a loop; test_loop_closure
constexpr double covariance_inflation = 4.0;  // [1] tuned: of the covariance that a registration claims, since the model errs, too: by simulated cameras; benchmarks/covariances.py
constexpr int least_loop_views = 3;  // [views] tuned: from view to view around a loop of views, at least; bunny12
constexpr std::size_t most_loop_views = 64;  // [views] budget: adjusted at once; bunny12
constexpr double loop_tolerance = 1.5;  // [spacing] tuned: to which views agree; bunny12
constexpr double most_surprise = 4.0 * covariance_inflation;  // [sigma^2] tuned: per unknown, of the newest view's registration; bunny12
constexpr double near_view = 4.0;  // [view_distance] tuned: of key frames whose outlines refine a pose; dog
constexpr std::size_t most_near_views = 3;  // [views] budget: whose outlines refine a pose; dog
constexpr int most_graph_steps = 50;  // [steps] budget: of Gauss-Newton; test_pose_graph
constexpr int most_suspects = 16;  // [edges] budget: that are taken out in turn to see what contradicts; test_pose_graph

}  // namespace nacre::loops_limits
// clang-format on
