// A block in each lane: 3 gathers and 12 other operations for a point of each.
#include "block_fit.hpp"

#include "vec.hpp"

namespace nacre::simd::NACRE_ISA {

void fit_blocks(const float* const* coordinates, BlockFit& fit) {
  alignas(64) static const int32_t starts[16] = {0,   16,  32,  48,  64,  80,  96,  112,
                                                 128, 144, 160, 176, 192, 208, 224, 240};
  for (int part = 0; part < 16; part += lanes) {
    const I32 start = load(starts + part);
    for (int axis = 0; axis < 3; ++axis) {
      const F32 first = gather(coordinates[axis], start);
      F32 lower = first, upper = first;
      for (int i = 1; i < 16; ++i) {
        const F32 found = gather(coordinates[axis], start + broadcast(i));
        lower = min(lower, found);
        upper = max(upper, select(found < broadcast(1e18F), found, first));
      }
      store(fit.lower[axis] + part, lower);
      store(fit.upper[axis] + part, upper);
    }
  }
}

}  // namespace nacre::simd::NACRE_ISA
