// A block in each lane: 3 gathers and 15 other operations for a point of each.
#include "simd/wlop_block_bounds.hpp"

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {

void fit_blocks(const float* const* coordinates, const int32_t* starts, BlockFit& fit) {
  for (int part = 0; part < 16; part += lanes) {
    const I32 start = load(starts + part), size = load(starts + part + 1) - start;
    for (int axis = 0; axis < 3; ++axis) {
      F32 lower = gather(coordinates[axis], start), upper = lower;
      for (int i = 1; i < 16; ++i) {
        const I32 index = broadcast(i);
        const F32 found = gather(coordinates[axis], start + select(index < size, index, broadcast(0)));
        lower = min(lower, found);
        upper = max(upper, found);
      }
      store(fit.lower[axis] + part, lower);
      store(fit.upper[axis] + part, upper);
    }
  }
}

}  // namespace nacre::simd::NACRE_ISA
