// The memory of the k-d tree, which kernels read.
#pragma once

#include <stdint.h>

namespace nacre {

constexpr int block_points = 16;
constexpr int group_boxes = 16;

// 16 points that are close together. Lanes beyond the last point are NaN, which no comparison lets through.
template <class T>
struct PointBlock {
  alignas(64) T p[3][block_points];  // x, y, z
  uint32_t id[block_points];
};

// The bounding boxes of 16 consecutive children (blocks, or groups of boxes) and their points' smallest ids. Lanes
// beyond the last child are infinitely far away.
template <class T>
struct BoxGroup {
  alignas(64) T lo[3][group_boxes];
  T hi[3][group_boxes];
  uint32_t first_id[group_boxes];
};

// Children of box j of group g have the numbers 16 (16 g + j) onwards in the level below; below level 0 are the blocks.
template <class T>
struct BlockTreeView {
  static constexpr int most_levels = 8;  // 16 * 16^7 = 2^32
  const PointBlock<T>* blocks;
  const BoxGroup<T>* levels[most_levels];
  int num_levels;  // the last has one group; 0 without points
};

}  // namespace nacre
