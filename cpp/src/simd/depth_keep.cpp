// Plain loops over bytes and floats, and one over vectors that become bits: 0.03 to 0.06 ms each for 640 x 480 pixels.
#include "simd/depth_keep.hpp"

#include <float.h>

#include "simd/depth_edges.hpp"
#include "simd/quadratic.hpp"
#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

NACRE_INLINE void select_values(const float* values, const uint8_t* keep, int count, float* kept) {
  for (int i = 0; i < count; ++i) kept[i] = values[i] + (keep[i] != 0 ? 0.0F : NAN);
}

}  // namespace

KeepCounts keep_pixels(const KeepRow& row, uint8_t* keep) {
  const KeepRow r = row;
  KeepCounts counts = {0, 0, 0, 0, 0};
  for (int u = 0; u < r.width; ++u) {
    const float z = r.depth[u];
    const int is_valid = (z > 0.0F) & (z <= FLT_MAX) & (r.direction_x[u] == r.direction_x[u]);
    const int is_in_range = is_valid & (z >= r.min_depth) & (z <= r.max_depth);
    const int is_unmasked = is_in_range & (r.mask == nullptr ? 1 : r.mask[u] != 0);
    const int is_no_edge = is_unmasked & ((r.marks[u] & edge_mark) == 0);
    const int is_kept = is_no_edge & ((r.marks[u] & slanted_mark) == 0);
    counts.num_invalid += 1 - is_valid;
    counts.num_out_of_range += is_valid - is_in_range;
    counts.num_masked += is_in_range - is_unmasked;
    counts.num_edge += is_unmasked - is_no_edge;
    counts.num_slanted += is_no_edge - is_kept;
    keep[u] = static_cast<uint8_t>(is_kept);
  }
  return counts;
}

void remove_isolated(const uint8_t* keep, ptrdiff_t stride, const uint8_t* least, int width, uint8_t* still_kept) {
  constexpr int tile = 252;  // pixels, of 256 columns
  for (int begin = 0; begin < width; begin += tile) {
    const int count = width - begin < tile ? width - begin : tile;
    const uint8_t* const first = keep + begin - 2;
    uint8_t column[tile + 4];
    for (int i = 0; i < count + 4; ++i) {
      column[i] = static_cast<uint8_t>(first[i - 2 * stride] + first[i - stride] + first[i] + first[i + stride] +
                                       first[i + 2 * stride]);
    }
    const uint8_t* const own = keep + begin;
    const uint8_t* const needed = least + begin;
    uint8_t* const stays = still_kept + begin;
    for (int i = 0; i < count; ++i) {
      const auto window =
          static_cast<uint8_t>(column[i] + column[i + 1] + column[i + 2] + column[i + 3] + column[i + 4]);
      stays[i] = static_cast<uint8_t>(own[i] & (window >= needed[i]));
    }
  }
}

int select_kept(const float* values, const uint8_t* keep, int width, float* kept) {
  select_values(values, keep, width, kept);
  int count = 0;
  for (int u = 0; u < width; ++u) count += keep[u];
  return count;
}

void link_pixels(const PlanarRow& row, const LinkRule& rule, const uint8_t* keep, ptrdiff_t keep_stride,
                 const Links& links) {
  const LinkRule r = rule;
  for (int begin = 0; begin < row.width; begin += chunk) {
    const int count = row.width - begin < chunk ? row.width - begin : chunk;
    const float* const values = row.values + begin;
    float own_and_left[chunk + 1], above[chunk];
    select_values(values - 1, keep + begin - 1, count + 1, own_and_left);
    select_values(values - row.stride, keep + begin - keep_stride, count, above);
    for (int i = count; i < chunk; ++i) own_and_left[i + 1] = NAN;
    uint64_t kept = 0, to_left = 0, to_above = 0;
    for (int i = 0; i < chunk; i += lanes) {
      const F32 a = load(own_and_left + i + 1);
      const F32 limit = evaluate(r.noise, a) + evaluate(r.slant, a);
      kept |= uint64_t{bits(a == a)} << i;
      to_left |= uint64_t{bits(abs(a - load(own_and_left + i)) <= limit)} << i;
      to_above |= uint64_t{bits(abs(a - load(above + i)) <= limit)} << i;
    }
    links.kept[begin / chunk] = kept;
    links.left[begin / chunk] = to_left;
    links.above[begin / chunk] = to_above;
  }
}

}  // namespace nacre::simd::NACRE_ISA
