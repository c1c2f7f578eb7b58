// Points in the order of a Hilbert curve, so that neighbours in space are neighbours in memory.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

// Cubic cells, fewer than 2^num_bits in each direction; what is outside belongs to the nearest.
struct CellLattice {
  Eigen::Array3d origin = Eigen::Array3d::Zero();
  Eigen::Array3d center = Eigen::Array3d::Zero();  // of the clouds; the first one's median if they are huge
  double cells_per_length = 1.0;
  int num_bits = 1;
  double reach = 0.0;  // of the clouds from the center, in cells
};

// Cells of the given edge around some clouds; if these are more than two million cells wide, around the middle of the
// first. Defined for Points and PointsDouble, as what follows.
template <class Cloud>
CellLattice cell_lattice(std::initializer_list<const Cloud*> clouds, double cell, int num_threads);

struct CellOrder {
  std::vector<std::uint32_t> rows;  // the finite ones; those in one cell ascend
  // A number for the cube of 32 cells edge that each lies in: another one wherever the cube changes.
  std::vector<std::uint32_t> cubes;
};

template <class Cloud>
CellOrder cell_order(const Cloud& points, const CellLattice& lattice, int num_threads);

// Orders the points of each cube by halving instead, for blocks of so many that are more compact and take longer to
// make.
template <class Cloud>
void halve_cubes(const Cloud& points, CellOrder& order, std::int64_t block_size, int num_threads);

// The place of a cell on a curve through 2^num_bits cells in each direction; num_bits is at most 21.
std::uint64_t hilbert_index(const std::uint32_t (&cell)[3], int num_bits);

}  // namespace nacre
