// A frame seen coarsely: one point for every square of pixels.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/types.hpp"
#include "region/limits.hpp"

namespace nacre {

struct Cell {
  Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();  // normal: 0 where there is none
  float sigma = 0.0F;                                                                 // [m]
  float footprint = 0.0F;  // the side of a cell on a surface that faces the camera there [m]
  std::int32_t pixel = -1;

  bool has_point() const { return pixel >= 0; }
};

struct CellBudget {
  int most_cells = region_limits::most_cells;      // of an image
  int largest_step = region_limits::largest_step;  // [pixels]
};

struct CoarseFrame {
  int width = 0, height = 0;
  int step = 1;  // [pixels]
  std::vector<Cell> cells;

  CoarseFrame() = default;
  CoarseFrame(const Frame& frame, const Camera& camera, const MaskRef& mask, const CellBudget& budget = {});
  int size() const { return static_cast<int>(cells.size()); }
  const Cell& operator[](int i) const { return cells[static_cast<std::size_t>(i)]; }

  // visit(j, steps) for the cells up to `reach` away along the image's axes and diagonals, where there is a point.
  template <class Visit>
  void for_neighbours(int i, int reach, Visit&& visit) const {
    const int u = i % width, v = i / width;
    for (int dv = -1; dv <= 1; ++dv) {
      for (int du = -1; du <= 1; ++du) {
        if (du == 0 && dv == 0) continue;
        for (int steps = 1; steps <= reach; ++steps) {
          const int x = u + steps * du, y = v + steps * dv;
          if (x < 0 || y < 0 || x >= width || y >= height) break;
          const int j = y * width + x;
          if (cells[static_cast<std::size_t>(j)].has_point()) visit(j, steps);
        }
      }
    }
  }
};

// Of an image, the pixels (1) without those (0) of cells that are left out.
MaskImage pixels_without(const std::vector<std::uint8_t>& is_left_out, const CoarseFrame& cells, int width, int height);

// A camera of whose pixels each sees a cell of a frame.
Camera coarse_camera(const Camera& camera, const CellBudget& budget);

// Connected cells: groups[i] is the number of cell i's group, -1 outside of all.
struct CellGroups {
  std::vector<std::int32_t> group;
  std::vector<std::int32_t> size;  // [cells]
};

// Cells of equal side (0: in no group) are connected where they are so near that a surface slanted by 70 degrees holds
// together.
CellGroups connect(const CoarseFrame& frame, const std::vector<std::uint8_t>& side);

// How many cells of each group lie at the image's border.
std::vector<std::int32_t> border_cells(const CoarseFrame& frame, const std::vector<std::int32_t>& group,
                                       std::size_t num_groups);

// How much the border cuts off of something: 0: nothing; about 1: a side of it; more: two and three sides.
inline double cut_off(std::int32_t num_border, std::int32_t size) {
  return static_cast<double>(num_border) * num_border / std::max(1, size);
}

// By how many pixels, on average, what a frame shows is elsewhere in the image from where the camera was before.
double mean_pixel_motion(const CoarseFrame& cells, const Pose& before_from_now);

// Whether a surface may go from one cell to another that is so many steps away.
bool are_linked(const Cell& a, const Cell& b, int steps);

}  // namespace nacre
