/// Points sorted into the cubes of a grid, in an order that follows from their coordinates alone.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

/// Cubes that fill a box; a cube's number counts along z first, then y, then x.
struct CubeGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< the corner of the first [m]
  double side = 1;                                   ///< of a cube [m]
  std::array<std::int64_t, 3> shape = {1, 1, 1};     ///< how many there are along each axis
};

/// A random number for each point, of the seed and the point's exact coordinates alone (the finaliser of splitmix64
/// over their bits in double precision; -0 is 0). num_threads = 0 uses all.
std::vector<std::uint64_t> point_hashes(const PointsRef& points, std::uint64_t seed, int num_threads = 0);
std::vector<std::uint64_t> point_hashes(const PointsDoubleRef& points, std::uint64_t seed, int num_threads = 0);

/// The number of the cube that each point lies in, for points outside that of the nearest. Throws std::invalid_argument
/// for a side that is not positive, or a shape below 1 or of more than 2^62 cubes.
std::vector<std::int64_t> cube_numbers(const PointsRef& points, const CubeGrid& grid, int num_threads = 0);
std::vector<std::int64_t> cube_numbers(const PointsDoubleRef& points, const CubeGrid& grid, int num_threads = 0);

/// Rows that have the same number.
struct NumberGroups {
  std::vector<std::int64_t> numbers;  ///< that occur, ascending
  std::vector<std::int64_t> counts;   ///< of the rows that have each
  std::vector<std::int64_t> rows;     ///< those of each number, ascending, one number's after the other's
};

/// Groups rows by their numbers, of which few are different.
NumberGroups group_by_number(const std::int64_t* numbers, std::int64_t count);

/// Rows in the order of their hashes.
struct HashOrder {
  std::vector<std::int64_t> rows;
  std::vector<std::uint64_t> hashes;  ///< of these rows
};

/// The rows [starts[i], starts[i + 1]) of each stretch by ascending hash, equal ones in the order of the rows. Throws
/// std::invalid_argument where starts do not ascend from 0 to the number of hashes.
HashOrder order_by_hash(const std::vector<std::int64_t>& starts, const std::uint64_t* hashes, std::int64_t count,
                        int num_threads = 0);

}  // namespace nacre
