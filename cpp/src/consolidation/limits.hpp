// Numbers that decide how points are consolidated; those of the methods' equations stand in them.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

// clang-format off
namespace nacre::consolidation_limits {

constexpr double same_place2 = 1e-12;  // [radius^2] derived: nearer points attract as if so far: 1 / r has no value at 0; test_wlop
constexpr double least_repelling2 = 1e-10;  // [radius^2] derived: a nearer sample is in the same place, and does not repel; test_wlop
constexpr double softening2 = 4e-4;  // [radius^2] tuned: of wlop_plus: nearer weighs hardly more; test_consolidation
constexpr double least_repulsion = 0.1;  // [1/radius] tuned: of wlop_plus: few neighbors push less than many; test_consolidation
constexpr double longest_step = 0.25;  // [radius] tuned: of a sample, by wlop_plus; test_wlop
constexpr double most_reach2 = 126.0;  // [unit^2] derived: 2^-126 is the smallest float in full precision; test_wlop
constexpr float box_rounding = 1.00001F;  // [1] derived: of a squared reach, so that rounding hides no block; test_wlop_pair_sums
constexpr double longest_block = 8.0;  // [radius] derived: within it single precision tells a millionth of the radius; test_wlop
constexpr double most_distant = 1e36;  // [unit] derived: from the middle: what single precision can hold, with room to spare; test_wlop

}  // namespace nacre::consolidation_limits
// clang-format on
