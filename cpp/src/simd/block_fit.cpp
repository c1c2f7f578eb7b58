// A block in each lane: 3 gathers and about 20 operations for a point of each.
#include "block_fit.hpp"

#include "vec.hpp"

namespace nacre::simd::NACRE_ISA {

void fit_blocks(const float* const* coordinates, BlockFit& fit) {
  alignas(64) static const int32_t starts[16] = {0,   16,  32,  48,  64,  80,  96,  112,
                                                 128, 144, 160, 176, 192, 208, 224, 240};
  for (int part = 0; part < 16; part += lanes) {
    const I32 start = load(starts + part);
    F32 first[3], lower[3], upper[3], squared_radius = broadcast(0.0F);
    for (int axis = 0; axis < 3; ++axis) first[axis] = lower[axis] = upper[axis] = gather(coordinates[axis], start);
    for (int i = 0; i < 16; ++i) {
      F32 squared_distance = broadcast(0.0F);
      for (int axis = 0; axis < 3; ++axis) {
        const F32 found = gather(coordinates[axis], start + broadcast(i));
        const F32 place = select(found < broadcast(1e18F), found, first[axis]);
        lower[axis] = min(lower[axis], place);
        upper[axis] = max(upper[axis], place);
        squared_distance = squared_distance + place * place;
      }
      squared_radius = max(squared_radius, squared_distance);
    }
    for (int axis = 0; axis < 3; ++axis) {
      store(fit.lower[axis] + part, lower[axis]);
      store(fit.upper[axis] + part, upper[axis]);
    }
    store(fit.squared_radius + part, squared_radius);
  }
}

}  // namespace nacre::simd::NACRE_ISA
