#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/kdtree.hpp"

namespace {

using namespace nacre;

constexpr double inf = KdTree::infinity;
constexpr float missing = std::numeric_limits<float>::quiet_NaN();

PointsDouble random_points(std::int64_t count, std::uint64_t seed) {
  PointsDouble points(count, 3);
  for (std::int64_t i = 0; i < points.size(); ++i)
    points.data()[i] = random_uniform(seed, static_cast<std::uint64_t>(i));
  return points;
}

struct Neighbor {
  double d2;
  std::int64_t index;
  bool operator<(const Neighbor& other) const { return d2 < other.d2 || (d2 == other.d2 && index < other.index); }
};

// Every finite point within max_distance of the query, in order.
template <class Matrix>
std::vector<Neighbor> brute_force(const Matrix& points, const Eigen::Vector3d& query, double max_distance) {
  std::vector<Neighbor> all;
  if (!query.allFinite()) return all;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) continue;
    const Eigen::Vector3d step = points.row(i).transpose().template cast<double>() - query;
    const double d2 = step.x() * step.x() + step.y() * step.y() + step.z() * step.z();
    if (std::sqrt(d2) <= max_distance) all.push_back({d2, i});
  }
  std::sort(all.begin(), all.end());
  return all;
}

// query, query_radius and nearest against brute force: the same indices, and distances with the same bits.
template <class Matrix, class Queries>
void check_all(const Matrix& points, const Queries& queries, int k, double max_distance) {
  const KdTree tree(points);
  REQUIRE(tree.size() == points.rows());
  const Neighbors found = tree.query(queries, k, max_distance);
  REQUIRE(found.indices.rows() == queries.rows());
  REQUIRE(found.indices.cols() == k);
  const double radius = std::isfinite(max_distance) ? max_distance : 0.1;
  const RadiusNeighbors within = tree.query_radius(queries, radius);
  REQUIRE(within.offsets.size() == static_cast<std::size_t>(queries.rows()) + 1);
  std::int64_t wrong = 0;
  for (Eigen::Index q = 0; q < queries.rows(); ++q) {
    const Eigen::Vector3d query = queries.row(q).transpose().template cast<double>();
    std::vector<Neighbor> expected = brute_force(points, query, max_distance);
    std::vector<std::int64_t> indices(static_cast<std::size_t>(k), -1);
    std::vector<double> d2(static_cast<std::size_t>(k), -1.0);
    const int count = tree.nearest(query, k, max_distance, indices.data(), d2.data());
    wrong += count != static_cast<int>(std::min<std::size_t>(expected.size(), static_cast<std::size_t>(k)));
    expected.resize(static_cast<std::size_t>(k), {inf, points.rows()});
    for (int j = 0; j < k; ++j) {
      const Neighbor& truth = expected[static_cast<std::size_t>(j)];
      wrong += found.indices(q, j) != truth.index || found.distances(q, j) != std::sqrt(truth.d2);
      if (j < count)
        wrong += indices[static_cast<std::size_t>(j)] != truth.index || d2[static_cast<std::size_t>(j)] != truth.d2;
    }
    const std::vector<Neighbor> inside = brute_force(points, query, radius);
    const std::int64_t begin = within.offsets[static_cast<std::size_t>(q)];
    REQUIRE(within.offsets[static_cast<std::size_t>(q) + 1] - begin == static_cast<std::int64_t>(inside.size()));
    for (std::size_t j = 0; j < inside.size(); ++j) {
      const std::size_t entry = static_cast<std::size_t>(begin) + j;
      wrong += within.indices[entry] != inside[j].index || within.distances[entry] != std::sqrt(inside[j].d2);
    }
  }
  CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("agrees with brute force for any size, k and distance") {
  const PointsDouble queries = random_points(60, 1);
  for (std::int64_t count : {0, 1, 2, 15, 16, 17, 127, 128, 129, 1000, 1025, 5000}) {
    const PointsDouble points = random_points(count, static_cast<std::uint64_t>(count) + 7);
    for (int k : {1, 2, 16, 33, 40, 65, 300}) {
      for (double max_distance : {inf, 0.1, 0.0}) {
        CAPTURE(count);
        CAPTURE(k);
        CAPTURE(max_distance);
        check_all(points, queries, k, max_distance);
        check_all(Points(points.cast<float>()), Points(queries.cast<float>()), k, max_distance);
      }
    }
  }
}

TEST_CASE("tree and queries may differ in precision") {
  const PointsDouble points = random_points(3000, 2), queries = random_points(200, 3);
  check_all(Points(points.cast<float>()), queries, 8, inf);
  check_all(points, Points(queries.cast<float>()), 8, inf);

  // Where floats are as coarse as the points' spacing, a query rounded to float has other neighbours.
  const Points coarse = (points * 0.01).array().cast<float>() + 4096.0f;
  check_all(coarse, PointsDouble((queries * 0.01).array() + 4096.0), 4, inf);
}

TEST_CASE("every query of a batch is answered as if it were alone") {
  const PointsDouble points = random_points(4000, 4);
  check_all(points, points, 5, inf);
  PointsDouble jumps(600, 3);  // from one corner to the other and back, with repetitions
  for (Eigen::Index i = 0; i < jumps.rows(); ++i)
    jumps.row(i).setConstant(i % 2 ? 0.999 : 0.001 * static_cast<double>(i % 7));
  for (int k : {5, 100}) {
    check_all(points, jumps, k, inf);
    check_all(points, jumps, k, 0.3);  // which of the corners have so many neighbours within differs
  }
}

TEST_CASE("equal distances are resolved by the smaller index") {
  PointsDouble lattice(9 * 9 * 9, 3);
  for (Eigen::Index i = 0; i < lattice.rows(); ++i) {
    const auto cell = static_cast<int>(i * 577 % lattice.rows());  // an order that is not the lattice's
    lattice.row(i) << cell % 9, cell / 9 % 9, cell / 81;
  }
  check_all(lattice, lattice, 10, inf);
  check_all(Points(lattice.cast<float>()), lattice, 10, std::sqrt(2.0));
  check_all(lattice, lattice, 250, inf);
  check_all(lattice, PointsDouble(lattice.array() + 0.5), 6, inf);
}

TEST_CASE("thousands of identical points") {
  PointsDouble points = random_points(20000, 5);
  points.topRows(15000).rowwise() = Eigen::RowVector3d(0.5, 0.5, 0.5);
  PointsDouble queries = random_points(30, 6);
  queries.topRows(10).rowwise() = Eigen::RowVector3d(0.5, 0.5, 0.5);
  for (int k : {20, 100}) check_all(points, queries, k, inf);
  const KdTree tree(points);
  const Neighbors all = tree.query(PointsDoubleRef(points.topRows(15000)), 3);
  CHECK((all.indices.rowwise() - Eigen::Matrix<std::int64_t, 1, 3>(0, 1, 2)).cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("a million metres away, doubles keep their digits") {
  PointsDouble points = random_points(3000, 8), queries = random_points(100, 9);
  const Eigen::RowVector3d far(1e6, -2e6, 3e6);
  check_all(PointsDouble(points.rowwise() + far), PointsDouble(queries.rowwise() + far), 8, inf);
  points.row(17) << 1e9, 1e9, -1e9;  // one outlier
  check_all(points, queries, 8, inf);
  check_all(Points(points.cast<float>()), queries, 8, inf);
}

TEST_CASE("clusters of any size beside each other") {
  PointsDouble points = random_points(6000, 16);
  points.middleRows(1000, 2000) *= 1e-4;
  points.middleRows(3000, 2000) *= 1e-9;
  points.row(5000) << 1e7, -1e7, 1e7;
  PointsDouble queries(60, 3);
  for (Eigen::Index i = 0; i < queries.rows(); ++i) queries.row(i) = points.row(100 * i) * 1.0001;
  for (int k : {16, 100}) check_all(points, queries, k, inf);
  check_all(points, queries, 2, 1e-5);
  check_all(Points(points.cast<float>()), Points(queries.cast<float>()), 16, inf);
  check_all(Points(points.cast<float>()), queries, 3, inf);
}

TEST_CASE("k beyond what is sorted side by side") {
  const PointsDouble points = random_points(2000, 17), queries = random_points(40, 18);
  for (int k : {8, 9, 20, 21, 44, 45, 64, 65, 200, 2000, 2001}) {
    CAPTURE(k);
    check_all(points, queries, k, inf);
    check_all(Points(points.cast<float>()), Points(queries.cast<float>()), k, 0.2);
  }
}

TEST_CASE("the rows of a wider matrix") {
  Eigen::Matrix<double, Eigen::Dynamic, 5, Eigen::RowMajor> wide(200, 5);
  wide.setConstant(1e9);
  wide.middleCols(1, 3) = random_points(200, 19);
  const PointsDouble points = wide.middleCols(1, 3);
  const Neighbors expected = KdTree(points).query(points, 4);
  const Neighbors found = KdTree(PointsDoubleRef(wide.middleCols(1, 3))).query(wide.middleCols(1, 3), 4);
  CHECK((found.indices.array() == expected.indices.array()).all());
  CHECK((found.distances.array() == expected.distances.array()).all());
}

TEST_CASE("extreme magnitudes") {
  for (double scale : {1e-300, 1e-30, 1e18, 1e150}) {
    CAPTURE(scale);
    const PointsDouble points = random_points(500, 10) * scale, queries = random_points(50, 11) * scale;
    check_all(points, queries, 4, inf);
  }
  check_all(Points(random_points(500, 10).cast<float>() * 1e-30f), Points(random_points(50, 11).cast<float>() * 1e-30f),
            4, inf);
  check_all(Points(random_points(500, 10).cast<float>()), PointsDouble(random_points(20, 11) * 1e100), 4, inf);
}

TEST_CASE("queries in double beyond the floats of the points") {
  Points points(20, 3);
  for (int i = 0; i < 60; ++i) points.data()[i] = static_cast<float>(i % 7);
  const KdTree tree(points);
  PointsDouble queries(3, 3);
  queries << -1e300, -1e300, -1e300, 1e300, 1e300, 1e300, -1e300, 1.0, 1e39;
  for (const double reach : {KdTree::infinity, 1e39, 1.0}) {
    const Neighbors found = tree.query(queries, 3, reach);
    CHECK((found.indices.array() >= 0).all());
    CHECK((found.indices.array() <= 20).all());
  }
}

TEST_CASE("points that are not finite are never found, queries that are not finite find nothing") {
  Points points = random_points(1000, 12).cast<float>();
  Points queries = random_points(40, 13).cast<float>();
  for (Eigen::Index i = 0; i < points.rows(); i += 3)
    points(i, i % 2) = i % 4 ? missing : -std::numeric_limits<float>::infinity();
  for (Eigen::Index i = 0; i < queries.rows(); i += 4)
    queries(i, 2) = i % 8 ? missing : std::numeric_limits<float>::infinity();
  check_all(points, queries, 5, inf);
  check_all(points, queries, 5, 0.2);
  points.setConstant(missing);
  check_all(points, queries, 2, inf);
}

TEST_CASE("all rows but the last of a tree's, with one that is not finite, as many as the tree has points") {
  Points points = Points::Random(40, 3);
  points(7, 1) = missing;
  const KdTree tree(points);
  const Neighbors found = tree.query(points.topRows(39), 1);
  for (Eigen::Index i = 0; i < 39; ++i) CHECK(found.indices(i, 0) == (i == 7 ? points.rows() : i));
}

TEST_CASE("a point at exactly the distance is found") {
  Points points(2, 3);
  points << 3, 4, 0, 0, 0, 9;
  const KdTree tree(points);
  std::int64_t index = -1;
  double d2 = -1;
  CHECK(tree.nearest(Eigen::Vector3d::Zero(), 1, 5.0, &index, &d2) == 1);
  CHECK(index == 0);
  CHECK(d2 == 25.0);
  CHECK(tree.nearest(Eigen::Vector3d::Zero(), 1, std::nextafter(5.0, 0.0), &index, &d2) == 0);
  CHECK(tree.query_radius(Points::Zero(1, 3), 9.0).indices == std::vector<std::int64_t>{0, 1});
}

TEST_CASE("a point whose distance rounds to the radius is found, though its square is above the radius's") {
  Points point(1, 3);
  point << 0.25F, 0, 0;
  const Eigen::Vector3d query(0, 16777216, 0);
  const KdTree tree(point);
  std::int64_t index = -1;
  double d2 = -1;
  CHECK(tree.nearest(query, 1, query.y(), &index, &d2) == 1);
  CHECK(d2 > query.squaredNorm());
  const Points queries = query.transpose().cast<float>();
  CHECK(tree.query(queries, 1, query.y()).indices(0, 0) == 0);
  CHECK(tree.query_radius(queries, query.y()).distances == std::vector<double>{query.y()});
}

TEST_CASE("the same bits for any number of threads") {
  const Points points = random_points(30000, 14).cast<float>();
  const KdTree one(points, 1), four(points, 4);
  const Neighbors a = one.query(points, 7, 0.05, 1);
  for (int num_threads : {2, 3, 4, 7, 8}) {
    const Neighbors b = KdTree(points, num_threads).query(points, 7, 0.05, num_threads);
    CHECK((a.indices.array() == b.indices.array()).all());
    CHECK((a.distances.array() == b.distances.array()).all());
  }
  const RadiusNeighbors c = one.query_radius(points, 0.03, 1), d = four.query_radius(points, 0.03, 4);
  CHECK(c.offsets == d.offsets);
  CHECK(c.indices == d.indices);
  CHECK(c.distances == d.distances);
}

TEST_CASE("illegal arguments") {
  const KdTree tree(random_points(10, 15));
  const Points queries = Points::Zero(1, 3);
  std::int64_t index;
  double d2;
  CHECK_THROWS_WITH_AS(tree.query(queries, 0), "k must be at least 1, got 0", std::invalid_argument);
  CHECK_THROWS_AS(tree.query(queries, 1, -1.0), std::invalid_argument);
  CHECK_THROWS_AS(tree.query(queries, 1, static_cast<double>(missing)), std::invalid_argument);
  CHECK_THROWS_AS(tree.query_radius(queries, -0.5), std::invalid_argument);
  CHECK_THROWS_AS(tree.nearest(Eigen::Vector3d::Zero(), 0, inf, &index, &d2), std::invalid_argument);
}
