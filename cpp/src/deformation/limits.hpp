// Numbers that decide how a model deforms.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>

// clang-format off
namespace nacre::deformation_limits {

constexpr int blended_nodes = 4;  // [nodes] budget: that move a point (Sumner 2007); test_warp_field
constexpr double first_nodes = 150.0;  // [nodes] budget: of what the first frame shows; benchmarks/deforming.py
constexpr double node_spacings = 6.0;  // [spacing] tuned: between nodes at least: fewer points do not tell a node's turn from noise; test_node_growth
constexpr double node_reach = 3.0;  // [node spacing] derived: along the surface, within which a point's five nearest nodes are; test_node_growth
constexpr double neighbor_spacings = 2.5;  // [spacing] tuned: between neighbours on a surface whose points lie at random; test_node_growth
constexpr float least_neighbor_cosine = 0.5F;  // [1] derived: between normals of neighbours, as of observations; test_node_growth
constexpr std::size_t most_rows = 8000;  // [points] budget: of the model, that a frame bends it by; benchmarks/deforming.py
constexpr int steps = 8;  // [1] budget: of Gauss and Newton, as the gate narrows; benchmarks/deforming.py
constexpr double first_gate = 0.5;  // [node spacing] budget: of matches at first: what moves farther in a frame has left its node behind; test_warp_registration
constexpr double misfit_by_noise = 18.0;  // [1] tuned: that a bend must explain, against what it explains of noise that no rows share: errors of the model are shared; benchmarks/deforming.py
constexpr double misfit_of_bending = 2.0;  // [1] derived: likewise, of what was bent at the frame before (Akaike 1974); test_warp_registration
constexpr double misfit_per_shared = 2.0;  // [1] derived: that it must explain of errors that neighbours share, by each row (Akaike 1974); test_warp_registration
constexpr double strain = 0.05;  // [1] tuned: standard deviation of an edge's stretch and bend against its length; benchmarks/deforming.py
constexpr double change = 0.02;  // [1] tuned: likewise, of the change from one frame to the next; benchmarks/deforming.py
constexpr double even_strain = 1.345;  // [strain] derived: beyond which an edge yields: joints bend more than the rest (Huber 1964); benchmarks/deforming.py
constexpr double first_stiffness = 10.0;  // [1] budget: how much stiffer the shape is at first; benchmarks/deforming.py
constexpr double largest_turn = 0.5;  // [rad] derived: of a node in one step, as far as a turn is about linear; test_warp_registration
constexpr double solver_tolerance = 1e-3;  // [1] budget: of a step's equations; benchmarks/deforming.py
constexpr int most_solver_steps = 60;  // [1] budget: likewise; benchmarks/deforming.py

}  // namespace nacre::deformation_limits
// clang-format on
