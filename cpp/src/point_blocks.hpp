// Points in blocks of 16 that lie close together, under a tree of boxes: the layout of the pair kernels.
#pragma once

#include <cstdint>
#include <vector>

#include "simd/pair_sums.hpp"
#include "cell_order.hpp"

namespace nacre {

// Where points lie in the kernels' unit of length: (point - center) scale.
struct Scaling {
  Eigen::Vector3d center;
  double scale;
};

class PointBlocks {
 public:
  static constexpr std::int64_t size = simd::block_size;

  // Blocks of points in their order; a block never spans two cubes of it. Defined for Points and PointsDouble.
  template <class Cloud>
  PointBlocks(const Cloud& points, const CellOrder& order, const Scaling& scaling, int num_threads);

  std::int64_t num_blocks() const { return static_cast<std::int64_t>(counts_.size()); }
  int count(std::int64_t block) const { return counts_[static_cast<std::size_t>(block)]; }

  // Row of the cloud of place i; block b has the places 16 b to 16 b + count(b) - 1.
  std::int64_t row(std::int64_t i) const { return rows_[static_cast<std::size_t>(i)]; }
  std::int64_t num_places() const { return size * num_blocks(); }

  // Coordinates relative to the origin of the block.
  std::vector<float>& axis(int axis) { return axes_[axis]; }
  const std::vector<float>& axis(int axis) const { return axes_[axis]; }
  // After the coordinates have changed.
  void refit(int num_threads);

  simd::PairPoints view(const float* mass) const;
  simd::PairTargets block(std::int64_t block) const;

 private:
  void fit_node(std::int64_t node);
  void fit_upper_levels();

  std::vector<std::uint32_t> rows_;
  std::vector<std::uint8_t> counts_;
  std::vector<float> axes_[3];  // with room for full nodes, as the next two
  std::vector<double> origins_;
  std::vector<float> halves_;
  std::vector<std::vector<float>> levels_;  // nodes of the box tree, level 0 first
};

}  // namespace nacre
