// Numbers that decide what is a supporting plane, and what stands on it.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

#include <cstddef>

// clang-format off
namespace nacre::region_limits {

constexpr int image_border = 1;  // [cell] derived: cleaning leaves little at the very border; test_region
constexpr int link_reach = 3;  // [cells] tuned: across which cells are linked: noisy edges are missing; test_region
constexpr int most_cells = 20000;  // [cells] budget: of an image seen coarsely; benchmarks/run.py
constexpr float least_cosine = 0.9F;  // [cosine] tuned: between normals of one plane, as measured; test_region
constexpr int largest_step = 12;  // [pixel] budget: side of a cell; benchmarks/run.py
constexpr float bend = 0.008F;  // [1] tuned: of a plane, as a part of its distance; dog
constexpr float plane_pixels = 2.0F;  // [pixel] tuned: margin of a plane: pixels; test_region
constexpr double least_plane = 0.1;  // [1] tuned: part of the points that a supporting plane holds; test_region
constexpr int num_hypotheses = 160;  // [planes] budget: from one point and normal each; test_region
constexpr int num_refined = 6;  // [planes] budget: of them, the best; test_region
constexpr int num_refinements = 5;  // [1] budget: least squares over a plane's cells, and its cells again; test_region
constexpr std::size_t most_voters = 3000;  // [cells] budget: that choose between the planes; test_region
constexpr std::size_t most_planes = 8;  // [planes] budget: in a frame; test_region
constexpr double small_part = 0.3;  // [1] tuned: of a plane: what may hang on its back; test_region
constexpr int num_candidates = 4;  // [planes] budget: tried before a frame is said to have no more; test_region
constexpr double goes_on = 1.0;  // [sides] derived: of a plane that the border cuts off: it goes on beyond; test_region
constexpr double same_thing = 0.25;  // [1] tuned: part of its pixels that a thing shares with the last one; test_region
constexpr int contact_reach = 12;  // [pixel] tuned: between a thing and the plane that it stands on, or parts that hide what joins them; test_region
constexpr float adoption_size = 0.75F;  // [1] tuned: of a thing's size: how far a contact may be; test_region
constexpr double background = 4.0;  // [sides] tuned: what the border cuts more of is background; test_region
constexpr double lower_end = 0.02;  // [1] tuned: part of a thing's points that are its lower end; test_region

}  // namespace nacre::region_limits
// clang-format on
