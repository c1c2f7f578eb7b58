// A hash grid of points to which points can be added: who is near, within the size of a cell.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/random.hpp"
#include "nacre/types.hpp"

namespace nacre {

class PointGrid {
 public:
  PointGrid(double cell_size, std::size_t expected_points) : inverse_size_(1.0F / static_cast<float>(cell_size)) {
    std::size_t num_buckets = 1024;
    while (num_buckets < 2 * expected_points) num_buckets *= 2;
    heads_.assign(num_buckets, -1);
    next_.reserve(expected_points);
  }

  // Points are numbered in the order in which they are added.
  void add(const Eigen::Vector3f& point) {
    const std::size_t bucket = bucket_of(cell_of(point));
    next_.push_back(heads_[bucket]);
    heads_[bucket] = static_cast<std::int32_t>(next_.size()) - 1;
  }

  // Whether test(i) holds for a point i among those of the 27 cells around `point` (and of cells that share a bucket).
  template <class Test>
  bool any_near(const Eigen::Vector3f& point, Test&& test) const {
    const Eigen::Vector3i center = cell_of(point);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          for (std::int32_t i = heads_[bucket_of(center + Eigen::Vector3i(dx, dy, dz))]; i >= 0;
               i = next_[static_cast<std::size_t>(i)]) {
            if (test(i)) return true;
          }
        }
      }
    }
    return false;
  }

 private:
  // So far off that cells are finer than floats, each float has a cell of its own.
  Eigen::Vector3i cell_of(const Eigen::Vector3f& point) const {
    constexpr float most = 1073741824.0F;
    Eigen::Vector3i cell;
    for (int axis = 0; axis < 3; ++axis) {
      const float place = std::floor(point[axis] * inverse_size_);
      if (place >= -most && place <= most) {
        cell[axis] = static_cast<int>(place);
      } else {
        std::int32_t bits;
        std::memcpy(&bits, &point[axis], sizeof bits);
        cell[axis] = bits & 0x3FFFFFFF;
      }
    }
    return cell;
  }
  std::size_t bucket_of(const Eigen::Vector3i& cell) const {
    const std::uint64_t key = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.x())) * 73856093U) ^
                              (static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.y())) << 21) ^
                              (static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.z())) << 42);
    return static_cast<std::size_t>(mix64(key)) & (heads_.size() - 1);
  }

  float inverse_size_;
  std::vector<std::int32_t> heads_, next_;
};

}  // namespace nacre
