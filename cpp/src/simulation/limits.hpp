// Numbers that decide how scenes and clouds are drawn.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

// clang-format off
namespace nacre::simulation_limits {

constexpr int max_radius = 40;  // [pixel] budget: of a disk; test_rendering
constexpr float min_radius = 0.75F;  // [pixel] derived: disks of neighbouring pixels meet; test_rendering
constexpr float reverse_radius = 0.7F;  // [1] tuned: of a front's: reverse sides must not stick out at rims; test_rendering
constexpr float least_tilt = 0.2F;  // [cosine] tuned: disks seen more from the side are drawn as if this steep; test_rendering
constexpr float outline_step = 6.0F;  // [pixel] tuned: larger steps in depth are outlines; test_rendering
constexpr double max_depth = 1e30;  // [pixel] derived: farther points are left out; test_rendering
constexpr int rays_per_radius = 4;  // [rays] budget: both ways, over a pixel that mixes what it sees; test_simulation
constexpr double background_room = 0.1;  // [diameter] tuned: from the mesh to a background that nobody has placed; test_simulation

}  // namespace nacre::simulation_limits
// clang-format on
