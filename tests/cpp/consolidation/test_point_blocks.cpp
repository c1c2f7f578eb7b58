#include <Eigen/Geometry>
#include <limits>
#include <set>

#include "base/random.hpp"
#include "consolidation/point_blocks.hpp"
#include "doctest/doctest.h"
#include "nacre/types.hpp"

using namespace nacre;

namespace {

PointsDouble random_points(int count) {
  PointsDouble points(count, 3);
  for (int i = 0; i < points.size(); ++i) points.data()[i] = random_uniform(5, static_cast<std::uint64_t>(i));
  return points;
}

// The mean size of the blocks; none is longer than it may be.
double size_of_blocks(const PointsDouble& points, const BlockRows& blocks, double longest) {
  double sum = 0.0;
  for (std::size_t block = 0; block + 1 < blocks.starts.size(); ++block) {
    REQUIRE(blocks.starts[block] < blocks.starts[block + 1]);
    CHECK(blocks.starts[block + 1] - blocks.starts[block] <= PointBlocks::size);
    Eigen::AlignedBox3d box;
    for (std::int32_t i = blocks.starts[block]; i < blocks.starts[block + 1]; ++i) {
      box.extend(Eigen::Vector3d(points.row(blocks.rows[as_size(i)]).transpose()));
    }
    CHECK(box.sizes().maxCoeff() <= longest);
    sum += box.diagonal().norm();
  }
  return sum / static_cast<double>(blocks.starts.size() - 1);
}

}  // namespace

TEST_CASE("blocks hold each finite row once, are short, and the same for any number of threads") {
  PointsDouble points = random_points(20000);
  points(100, 1) = std::numeric_limits<double>::quiet_NaN();
  points(19999, 2) = -std::numeric_limits<double>::infinity();
  points.row(500) = points.row(7);
  points.row(0) << 1e9, -1e9, 1e9;
  const Rows<double> rows(points);
  double sizes[2];
  for (const bool halved : {false, true}) {
    const BlockRows blocks = block_rows(rows, 0.4, halved, 1);
    CHECK(blocks.rows.size() == 19998);
    CHECK(std::set<std::uint32_t>(blocks.rows.begin(), blocks.rows.end()).size() == 19998);
    CHECK(blocks.starts.size() < 1.1 * 20000 / PointBlocks::size);
    sizes[halved ? 1 : 0] = size_of_blocks(points, blocks, 0.4);
    for (const int threads : {2, 3, 4, 7, 8}) {
      const BlockRows again = block_rows(rows, 0.4, halved, threads);
      CHECK(again.rows == blocks.rows);
      CHECK(again.starts == blocks.starts);
    }
  }
  CHECK(sizes[1] < 0.95 * sizes[0]);
}

TEST_CASE("blocks of no points, one point, a row stride") {
  CHECK(block_rows(Rows<double>(PointsDouble(0, 3)), 1.0, true, 1).rows.empty());
  CHECK(block_rows(Rows<double>(PointsDouble::Constant(3, 3, std::numeric_limits<double>::quiet_NaN())), 1.0, true, 1)
            .rows.empty());
  CHECK(block_rows(Rows<double>(PointsDouble::Constant(1, 3, 1e300)), 1.0, true, 1).rows.size() == 1);
  const PointsDouble points = random_points(200);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> wide(200, 5);
  wide << points, Eigen::MatrixXd::Zero(200, 2);
  CHECK(block_rows(Rows<double>(wide.leftCols(3)), 1.0, true, 1).rows ==
        block_rows(Rows<double>(points), 1.0, true, 1).rows);
}
