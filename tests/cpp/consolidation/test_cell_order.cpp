#include <algorithm>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <set>

#include "base/random.hpp"
#include "consolidation/cell_order.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

template <class Matrix>
Matrix random_points(int count, double size) {
  Matrix points(count, 3);
  for (int i = 0; i < points.size(); ++i) {
    points.data()[i] = static_cast<typename Matrix::Scalar>(size * random_uniform(5, static_cast<std::uint64_t>(i)));
  }
  return points;
}

CellOrder order_of(const PointsDouble& points, double cell, int threads = 1) {
  const PointsDoubleRef ref(points);
  return cell_order(ref, cell_lattice<PointsDoubleRef>({&ref}, cell, threads), threads);
}

}  // namespace

TEST_CASE("the curve visits every cell once and steps to a neighbour") {
  for (int bits = 1; bits <= 4; ++bits) {
    const std::uint32_t size = 1U << bits;
    std::vector<std::array<std::uint32_t, 3>> path(size * size * size);
    std::set<std::uint64_t> visited;
    for (std::uint32_t x = 0; x < size; ++x) {
      for (std::uint32_t y = 0; y < size; ++y) {
        for (std::uint32_t z = 0; z < size; ++z) {
          const std::uint64_t index = hilbert_index({x, y, z}, bits);
          REQUIRE(index < path.size());
          visited.insert(index);
          path[index] = {x, y, z};
        }
      }
    }
    CHECK(visited.size() == path.size());
    for (std::size_t i = 1; i < path.size(); ++i) {
      int steps = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        steps += std::abs(static_cast<int>(path[i][axis]) - static_cast<int>(path[i - 1][axis]));
      }
      CHECK(steps == 1);
    }
  }
}

TEST_CASE("the order holds each finite row once, by the curve, the same for any number of threads") {
  for (const double cell : {0.1, 1e-3, 1e-7}) {  // short and long keys
    PointsDouble points = random_points<PointsDouble>(20000, 1.0);
    points(100, 1) = std::numeric_limits<double>::quiet_NaN();
    points(19999, 2) = -std::numeric_limits<double>::infinity();
    points.row(500) = points.row(7);
    const PointsDoubleRef ref(points);
    const CellLattice lattice = cell_lattice<PointsDoubleRef>({&ref}, cell, 1);
    const CellOrder order = cell_order(ref, lattice, 1);
    CHECK(order.rows.size() == 19998);
    CHECK(std::set<std::uint32_t>(order.rows.begin(), order.rows.end()).size() == 19998);
    std::uint64_t last = 0;
    for (std::size_t i = 0; i < order.rows.size(); ++i) {
      if (cell > 1e-7) {  // finer ones than the lattice has
        std::uint32_t cells[3];
        for (int axis = 0; axis < 3; ++axis) {
          cells[axis] = static_cast<std::uint32_t>((points(order.rows[i], axis) - lattice.origin[axis]) / cell);
        }
        const std::uint64_t index = hilbert_index(cells, lattice.num_bits);
        CHECK(index >= last);
        if (index == last && i > 0) CHECK(order.rows[i] > order.rows[i - 1]);
        if (i > 0) CHECK((index >> 15 == last >> 15) == (order.cubes[i] == order.cubes[i - 1]));
        last = index;
      }
    }
    for (const int threads : {2, 3, 4, 7, 8}) {
      const CellOrder again = order_of(points, cell, threads);
      CHECK(again.rows == order.rows);
      CHECK(again.cubes == order.cubes);
    }
  }
}

TEST_CASE("strays do not coarsen the cells of the others") {
  PointsDouble points = random_points<PointsDouble>(3000, 1.0);
  const std::vector<std::uint32_t> before = order_of(points, 0.05).cubes;
  points.row(0) << 1e9, -1e9, 1e9;
  const std::vector<std::uint32_t> after = order_of(points, 0.05).cubes;
  CHECK(std::set<std::uint32_t>(after.begin(), after.end()).size() >= 8);
  CHECK(std::set<std::uint32_t>(before.begin(), before.end()).size() >= 1);
  CHECK(after.size() == 3000);
}

TEST_CASE("halving keeps the points of each cube and makes compact blocks, the same for any number of threads") {
  const PointsDouble points = random_points<PointsDouble>(20000, 1.0);
  const PointsDoubleRef ref(points);
  const CellLattice lattice = cell_lattice<PointsDoubleRef>({&ref}, 0.01, 1);
  const CellOrder before = cell_order(ref, lattice, 1);
  CellOrder halved = before;
  halve_cubes(ref, halved, 16, 1);
  CHECK(halved.cubes == before.cubes);
  double sizes[2] = {};
  for (std::size_t first = 0, last; first < before.rows.size(); first = last) {
    for (last = first; last < before.rows.size() && before.cubes[last] == before.cubes[first];) ++last;
    const auto at = [](const CellOrder& order, std::size_t i) {
      return order.rows.begin() + static_cast<std::ptrdiff_t>(i);
    };
    CHECK(std::set<std::uint32_t>(at(before, first), at(before, last)) ==
          std::set<std::uint32_t>(at(halved, first), at(halved, last)));
    for (std::size_t i = first; i + 16 <= last; i += 16) {
      Eigen::AlignedBox3d boxes[2];
      for (std::size_t j = i; j < i + 16; ++j) {
        boxes[0].extend(Eigen::Vector3d(points.row(before.rows[j]).transpose()));
        boxes[1].extend(Eigen::Vector3d(points.row(halved.rows[j]).transpose()));
      }
      for (int k = 0; k < 2; ++k) sizes[k] += boxes[k].diagonal().norm();
    }
  }
  CHECK(sizes[1] < 0.95 * sizes[0]);
  for (const int threads : {2, 3, 4, 7, 8}) {
    CellOrder again = before;
    halve_cubes(ref, again, 16, threads);
    CHECK(again.rows == halved.rows);
  }
}

TEST_CASE("no points, one point, a row stride") {
  CHECK(order_of(PointsDouble(0, 3), 1.0).rows.empty());
  CHECK(order_of(PointsDouble::Constant(3, 3, std::numeric_limits<double>::quiet_NaN()), 1.0).rows.empty());
  CHECK(order_of(PointsDouble::Constant(1, 3, 1e300), 1.0).rows.size() == 1);
  const PointsDouble points = random_points<PointsDouble>(200, 1.0);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> wide(200, 5);
  wide << points, Eigen::MatrixXd::Zero(200, 2);
  const PointsDoubleRef strided(wide.leftCols(3));
  CHECK(cell_order(strided, cell_lattice<PointsDoubleRef>({&strided}, 0.1, 1), 1).rows == order_of(points, 0.1).rows);
}
