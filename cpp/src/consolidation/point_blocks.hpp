// Points in blocks of 16 that lie close together, under a tree of boxes: the layout of the pair kernels.
#pragma once

#include <cstdint>
#include <vector>

#include "base/numbers.hpp"
#include "base/point_rows.hpp"
#include "simd/wlop_pair_sums.hpp"

namespace nacre {

// Where points lie in the kernels' unit of length: (point - center) scale.
struct Scaling {
  Eigen::Vector3d center;
  double scale;
};

// Finite rows of a cloud in blocks, along the order in space. Block b has rows[starts[b]] to rows[starts[b + 1] - 1].
struct BlockRows {
  std::vector<std::uint32_t> rows;
  std::vector<std::int32_t> starts;
};

// Blocks of which none is longer than `longest`. Halved stretches of the curve make more compact ones, and take longer.
template <class T>
BlockRows block_rows(const Rows<T>& points, double longest, bool halved, int num_threads);

class PointBlocks {
 public:
  static constexpr std::int64_t size = simd::block_size;

  template <class T>
  PointBlocks(const Rows<T>& points, BlockRows blocks, const Scaling& scaling, int num_threads);

  std::int64_t num_points() const { return static_cast<std::int64_t>(rows_.size()); }
  std::int64_t row(std::int64_t i) const { return rows_[static_cast<std::size_t>(i)]; }  // of the cloud

  // Block b has the points begin(b) to end(b) - 1.
  std::int64_t num_blocks() const { return static_cast<std::int64_t>(starts_.size()) - 1; }
  std::int64_t begin(std::int64_t block) const { return starts_[static_cast<std::size_t>(block)]; }
  std::int64_t end(std::int64_t block) const { return starts_[static_cast<std::size_t>(block) + 1]; }

  // Coordinates relative to the origin of the block.
  std::vector<float>& axis(int axis) { return axes_[axis]; }
  const std::vector<float>& axis(int axis) const { return axes_[axis]; }
  // The largest coordinate.
  double reach() const;
  // After the coordinates have changed.
  void refit(int num_threads);

  // Values a point must be readable as far, for the kernels.
  std::int64_t num_readable() const { return num_points() + size - 1; }

  simd::PairPoints view(const float* mass) const;
  simd::PairTargets block(std::int64_t block) const;

 private:
  void fit_node(std::int64_t node);
  void fit_upper_levels();

  std::vector<std::uint32_t> rows_;
  std::vector<std::int32_t> starts_;
  std::vector<float> axes_[3];
  std::vector<double> origins_;
  std::vector<float> halves_;
  std::vector<std::vector<float>> levels_;  // nodes of the box tree, level 0 first
};

}  // namespace nacre
