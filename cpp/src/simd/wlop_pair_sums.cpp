// The blocks near a block of targets are copied next to each other in the targets' frame, into the first-level cache.
// Boxes around them tell which targets they may reach: each such pair of a target, in all lanes, and a block, whose
// points are in the lanes, is one round of a single long loop. Sums are kept in 16 lanes whatever the width of a
// vector; multiplications and additions are fused where the instruction set can, so that the baseline rounds
// differently. A round is 16 pairs of points, 25 to 45 operations and, with AVX-512 at 4 GHz, 3 to 4 ns; finding the
// pairs takes 1 to 2 ns a round more.
#include "simd/wlop_pair_sums.hpp"

#include "simd/move_lanes.hpp"

#ifdef _MSC_VER
#include <intrin.h>
#endif

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int chunk_blocks = 64;
constexpr float far_away = 1e18F;  // from anything, and its square is a float

NACRE_INLINE int lowest_bit(unsigned mask) {
#ifdef _MSC_VER
  unsigned long index;
  _BitScanForward(&index, mask);
  return static_cast<int>(index);
#else
  return __builtin_ctz(mask);
#endif
}

// Those of 8 or 16 boxes of a node, from `part` on, that come within a squared distance of the targets' box.
NACRE_INLINE Mask near_boxes(const float* node, int part, const PairTargets& targets, F32 squared_distance) {
  F32 sum = broadcast(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    const float* lower = node + axis * block_size + part;
    const F32 below = load(lower) - broadcast(targets.upper[axis]);
    const F32 above = broadcast(targets.lower[axis]) - load(lower + 3 * block_size);
    const F32 gap = max(max(below, above), broadcast(0.0F));
    sum = mul_add(gap, gap, sum);
  }
  return sum <= squared_distance;
}

// The blocks whose boxes come within a squared distance of the targets' box, ascending. Calls visit(blocks, count) with
// 1 to chunk_blocks of them.
template <class Visit>
NACRE_INLINE void for_near_blocks(const BoxTree& tree, const PairTargets& targets, float least_squared_distance,
                                  Visit&& visit) {
  if (tree.num_levels == 0) return;
  const F32 squared_distance = broadcast(least_squared_distance);
  int32_t blocks[chunk_blocks + 2 * block_size];
  int num_blocks = 0;
  unsigned left[most_levels];  // children to visit of the node that is open at a level
  int32_t node[most_levels + 1];
  const int top = tree.num_levels - 1;
  int level = top;
  node[top] = 0;
  for (;;) {  // opens node[level]
    const float* boxes = tree.nodes[level] + static_cast<int64_t>(node[level]) * node_floats;
    const int32_t first = node[level] * block_size;
    left[level] = 0;
    for (int part = 0; part < block_size; part += lanes) {
      const Mask near = near_boxes(boxes, part, targets, squared_distance);
      if (level > 0) {
        left[level] |= bits(near) << part;
      } else {
        store_chosen(blocks + num_blocks, near, lane_numbers() + broadcast(first + part));
        num_blocks += count(near);
      }
    }
    if (num_blocks >= chunk_blocks) {
      visit(blocks, chunk_blocks);
      num_blocks -= chunk_blocks;
      for (int part = 0; part < block_size; part += lanes) store(blocks + part, load(blocks + chunk_blocks + part));
    }
    while (level <= top && left[level] == 0) ++level;
    if (level > top) break;
    node[level - 1] = node[level] * block_size + lowest_bit(left[level]);
    left[level] &= left[level] - 1;
    --level;
  }
  if (num_blocks > 0) visit(blocks, num_blocks);
}

// 2^(-s) for 0 <= s <= 126 by a polynomial, relative error 1.3e-7; anything for other s.
NACRE_INLINE F32 exp2_of_minus(F32 s) {
  const F32 rounder = broadcast(12582912.0F);  // 1.5 * 2^23: a sum with it has no bits below 1
  const F32 rounded = s + rounder;
  const F32 f = (rounded - rounder) - s;
  F32 power = broadcast(0.00132764736F);
  power = mul_add(power, f, broadcast(0.00967554188F));
  power = mul_add(power, f, broadcast(0.0555071327F));
  power = mul_add(power, f, broadcast(0.240221197F));
  power = mul_add(power, f, broadcast(0.693146967F));
  power = mul_add(power, f, broadcast(1.0F));
  return as_float(as_int(power) - shift_left<23>(as_int(rounded)));
}

struct Kernel {
  F32 reach2, skip2, softening2;

  explicit NACRE_INLINE Kernel(const PairKernel& kernel)
      : reach2(broadcast(kernel.reach2)), skip2(broadcast(kernel.skip2)), softening2(broadcast(kernel.softening2)) {}

  NACRE_INLINE Mask counts(F32 squared_distance) const {
    return (squared_distance < reach2) & (squared_distance > skip2);
  }
  template <int decay>
  NACRE_INLINE F32 weight(F32 squared_distance) const {
    const F32 theta = exp2_of_minus(squared_distance);
    if constexpr (decay == 1) return theta / sqrt(squared_distance + softening2);
    if constexpr (decay == 2) return theta / squared_distance;
    return theta;
  }
};

// Blocks in the targets' frame, and the pairs of a target and a block to sum over.
struct Chunk {
  int num_blocks = 0, num_pairs = 0;
  alignas(64) float x[chunk_blocks * block_size], y[chunk_blocks * block_size], z[chunk_blocks * block_size];
  alignas(64) float mass[chunk_blocks * block_size];
  int32_t pairs[(chunk_blocks + 1) * block_size];  // 16 times the block, plus the target

  template <bool with_mass>
  NACRE_INLINE void add(const PairPoints& points, int32_t block, const PairTargets& targets, float reach2) {
    const double* origin = points.origin + 3 * static_cast<int64_t>(block);
    const F32 shift_x = broadcast(static_cast<float>(origin[0] - targets.origin[0]));
    const F32 shift_y = broadcast(static_cast<float>(origin[1] - targets.origin[1]));
    const F32 shift_z = broadcast(static_cast<float>(origin[2] - targets.origin[2]));
    const float* halves = points.halves + 3 * static_cast<int64_t>(block);
    const int num_points = points.starts[block + 1] - points.starts[block];
    for (int part = 0; part < block_size; part += lanes) {
      const int64_t from = static_cast<int64_t>(points.starts[block]) + part;
      const int to = num_blocks * block_size + part;
      store(x + to, select(first_lanes(num_points - part), load(points.x + from) + shift_x, broadcast(far_away)));
      store(y + to, load(points.y + from) + shift_y);
      store(z + to, load(points.z + from) + shift_z);
      if constexpr (with_mass) store(mass + to, load(points.mass + from));

      const F32 gap_x = max(abs(load(targets.x + part) - shift_x) - broadcast(halves[0]), broadcast(0.0F));
      const F32 gap_y = max(abs(load(targets.y + part) - shift_y) - broadcast(halves[1]), broadcast(0.0F));
      const F32 gap_z = max(abs(load(targets.z + part) - shift_z) - broadcast(halves[2]), broadcast(0.0F));
      const F32 squared_gap = mul_add(gap_z, gap_z, mul_add(gap_y, gap_y, gap_x * gap_x));
      const Mask near = (squared_gap < broadcast(reach2)) & first_lanes(targets.count - part);
      store_chosen(pairs + num_pairs, near, lane_numbers() + broadcast(num_blocks * block_size + part));
      num_pairs += count(near);
    }
    ++num_blocks;
  }
};

template <int decay, PairSums which, bool with_mass>
void sum(const PairKernel& pair_kernel, const PairTargets& targets, const PairPoints& points, float* sums) {
  constexpr bool with_count = which == PairSums::mass_and_count;
  constexpr bool with_first = which == PairSums::first || which == PairSums::second;
  constexpr bool with_second = which == PairSums::second;
  constexpr int num_sums = with_second ? 10 : with_first ? 4 : with_count ? 2 : 1;
  const Kernel kernel(pair_kernel);
  alignas(64) float partial[block_size][num_sums][block_size];
  memset(static_cast<void*>(partial), 0, static_cast<size_t>(targets.count) * sizeof partial[0]);
  Chunk chunk;

  const auto add_pairs = [&] {
    for (int pair = 0; pair < chunk.num_pairs; ++pair) {
      const int i = chunk.pairs[pair] % block_size, first = chunk.pairs[pair] - i;
      const F32 x = broadcast(targets.x[i]), y = broadcast(targets.y[i]), z = broadcast(targets.z[i]);
      for (int part = 0; part < block_size; part += lanes) {
        const int at = first + part;
        const F32 dx = load(chunk.x + at) - x, dy = load(chunk.y + at) - y, dz = load(chunk.z + at) - z;
        const F32 squared_distance = mul_add(dz, dz, mul_add(dy, dy, dx * dx));
        const Mask counts = kernel.counts(squared_distance);
        F32 w = kernel.weight<decay>(squared_distance);
        if constexpr (with_mass) w = w * load(chunk.mass + at);
        w = select(counts, w, broadcast(0.0F));

        const auto total = [&](int s) { return partial[i][s] + part; };
        const auto add = [&](int s, F32 a, F32 b) { store(total(s), mul_add(a, b, load(total(s)))); };
        store(total(0), load(total(0)) + w);
        if constexpr (with_count) {
          store(total(1), load(total(1)) + select(counts, broadcast(1.0F), broadcast(0.0F)));
        }
        if constexpr (with_first) {
          add(1, w, dx);
          add(2, w, dy);
          add(3, w, dz);
        }
        if constexpr (with_second) {
          const F32 wx = w * dx, wy = w * dy, wz = w * dz;
          add(4, wx, dx);
          add(5, wx, dy);
          add(6, wx, dz);
          add(7, wy, dy);
          add(8, wy, dz);
          add(9, wz, dz);
        }
      }
    }
    chunk.num_blocks = chunk.num_pairs = 0;
  };

  const float reach2 = 1.000002F * pair_kernel.reach2;
  for_near_blocks(points.tree, targets, reach2, [&](const int32_t* blocks, int num_blocks) {
    for (int k = 0; k < num_blocks; ++k) chunk.add<with_mass>(points, blocks[k], targets, reach2);
    add_pairs();
  });

  for (int i = 0; i < targets.count; ++i) {
    for (int s = 0; s < num_sums; ++s) {
      F32 v[block_size / lanes];
      for (int part = 0; part < block_size; part += lanes) v[part / lanes] = load(partial[i][s] + part);
      sums[s * block_size + i] = sum_lanes(v);
    }
  }
}

template <int decay, PairSums which>
void sum(const PairKernel& kernel, const PairTargets& targets, const PairPoints& points, float* sums) {
  points.mass != nullptr ? sum<decay, which, true>(kernel, targets, points, sums)
                         : sum<decay, which, false>(kernel, targets, points, sums);
}

template <int decay>
void weigh(const PairKernel& pair_kernel, const PairTargets& targets, int i, const PairPoints& points,
           const int32_t* blocks, int64_t num_blocks, float* weights) {
  const Kernel kernel(pair_kernel);
  for (int64_t b = 0; b < num_blocks; ++b) {
    const double* origin = points.origin + 3 * static_cast<int64_t>(blocks[b]);
    const F32 x = broadcast(targets.x[i]), shift_x = broadcast(static_cast<float>(origin[0] - targets.origin[0]));
    const F32 y = broadcast(targets.y[i]), shift_y = broadcast(static_cast<float>(origin[1] - targets.origin[1]));
    const F32 z = broadcast(targets.z[i]), shift_z = broadcast(static_cast<float>(origin[2] - targets.origin[2]));
    for (int part = 0; part < block_size; part += lanes) {
      const int64_t from = static_cast<int64_t>(points.starts[blocks[b]]) + part;
      const Mask exists = first_lanes(points.starts[blocks[b] + 1] - points.starts[blocks[b]] - part);
      const F32 dx = load(points.x + from) + shift_x - x;
      const F32 dy = load(points.y + from) + shift_y - y;
      const F32 dz = load(points.z + from) + shift_z - z;
      const F32 squared_distance = mul_add(dz, dz, mul_add(dy, dy, dx * dx));
      F32 w = kernel.weight<decay>(squared_distance);
      if (points.mass != nullptr) w = w * load(points.mass + from);
      store(weights + b * block_size + part, select(exists & kernel.counts(squared_distance), w, broadcast(0.0F)));
    }
  }
}

}  // namespace

void sum_pairs(const PairKernel& kernel, PairSums which, const PairTargets& targets, const PairPoints& points,
               float* sums) {
  if (which == PairSums::mass) {
    sum<0, PairSums::mass>(kernel, targets, points, sums);
  } else if (which == PairSums::mass_and_count) {
    sum<0, PairSums::mass_and_count>(kernel, targets, points, sums);
  } else if (which == PairSums::first) {
    if (kernel.decay == 0) sum<0, PairSums::first>(kernel, targets, points, sums);
    if (kernel.decay == 1) sum<1, PairSums::first>(kernel, targets, points, sums);
    if (kernel.decay == 2) sum<2, PairSums::first>(kernel, targets, points, sums);
  } else {
    if (kernel.decay == 0) sum<0, PairSums::second>(kernel, targets, points, sums);
    if (kernel.decay == 1) sum<1, PairSums::second>(kernel, targets, points, sums);
  }
}

void weigh_pairs(const PairKernel& kernel, const PairTargets& targets, int target, const PairPoints& points,
                 const int32_t* blocks, int64_t num_blocks, float* weights) {
  if (kernel.decay == 0) weigh<0>(kernel, targets, target, points, blocks, num_blocks, weights);
  if (kernel.decay == 1) weigh<1>(kernel, targets, target, points, blocks, num_blocks, weights);
}

void visit_blocks(float squared_distance, const PairTargets& targets, const BoxTree& tree,
                  void (*visit)(void* context, int32_t block), void* context) {
  for_near_blocks(tree, targets, squared_distance, [&](const int32_t* blocks, int num_blocks) {
    for (int k = 0; k < num_blocks; ++k) visit(context, blocks[k]);
  });
}

}  // namespace nacre::simd::NACRE_ISA
