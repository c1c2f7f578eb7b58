#include <Eigen/Eigenvalues>
#include <cmath>
#include <stdexcept>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/normals.hpp"

namespace {

using namespace nacre;
using Eigen::Vector3d;

// A square of side 1 in the plane z = 0 with noise along z, random or as a grid.
PointsDouble square(int side, double noise, std::uint64_t seed, bool grid = false) {
  PointsDouble points(side * side, 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto c = static_cast<std::uint64_t>(i);
    points(i, 0) = grid ? static_cast<double>(i % side) / side : random_uniform(seed, 2 * c);
    points(i, 1) = grid ? static_cast<double>(i / side) / side : random_uniform(seed, 2 * c + 1);
    points(i, 2) = noise > 0 ? noise * random_normal(seed + 1, c) : 0;
  }
  return points;
}

template <class Matrix>
std::int64_t missing(const Matrix& normals) {
  return (normals.col(0).array() != normals.col(0).array()).count();
}

}  // namespace

TEST_CASE("the normals of a plane, in any pose") {
  const PointsDouble flat = square(30, 0, 1);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Vector3d axis(random_normal(seed, 0), random_normal(seed, 1), random_normal(seed, 2));
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(2.0, axis.normalized()).toRotationMatrix();
    const PointsDouble points = (flat * rotation.transpose()).rowwise() + Eigen::RowVector3d(1e6, -1e6, 1e6);
    const Vector3d normal = rotation.col(2), viewpoint = points.row(0).transpose() - 2.0 * normal;
    const PointsDouble normals = estimate_normals(points, {}, viewpoint);
    CHECK((normals.rowwise() + normal.transpose()).cwiseAbs().maxCoeff() < 1e-8);
  }
  const Points single = estimate_normals(Points(flat.cast<float>()), {}, Vector3d(0.5, 0.5, 3));
  CHECK((single.rowwise() - Eigen::RowVector3f(0, 0, 1)).cwiseAbs().maxCoeff() == 0);
}

TEST_CASE("the least eigenvector of the neighbours' covariance") {
  const PointsDouble points = square(20, 0.02, 2);
  const KdTree tree(points);
  NormalOptions options;
  options.k = 10;
  const Neighbors neighbors = tree.query(points, options.k);
  const PointsDouble normals = estimate_normals(points, options, Vector3d(0, 0, 9));
  double worst = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (std::isnan(normals(i, 0))) continue;
    PointsDouble near(options.k, 3);
    for (int j = 0; j < options.k; ++j) near.row(j) = points.row(neighbors.indices(i, j));
    near.rowwise() -= near.colwise().mean().eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(near.transpose() * near);
    worst = std::max(worst, solver.eigenvectors().col(0).cross(normals.row(i).transpose()).norm());
  }
  CHECK(worst < 1e-10);
  CHECK(missing(normals) < 10);
}

TEST_CASE("towards the viewpoint") {
  PointsDouble sphere(2000, 3);
  for (Eigen::Index i = 0; i < sphere.rows(); ++i) {
    for (int axis = 0; axis < 3; ++axis) sphere(i, axis) = random_normal(3, static_cast<std::uint64_t>(3 * i + axis));
    sphere.row(i).normalize();
  }
  const PointsDouble inwards = estimate_normals(sphere);
  CHECK((inwards.array() * sphere.array()).rowwise().sum().maxCoeff() < -0.99);
  const PointsDouble seen = estimate_normals(sphere, {}, Vector3d(0, 0, 10));
  for (Eigen::Index i = 0; i < sphere.rows(); ++i)
    CHECK(seen.row(i).dot(Eigen::RowVector3d(0, 0, 10) - sphere.row(i)) >= 0);
}

TEST_CASE("a noisy surface keeps its normals") {
  const int side = 100;
  for (bool grid : {false, true}) {
    const PointsDouble points = square(side, 0.5 / side, 4, grid);  // noise of half the spacing
    CHECK(missing(estimate_normals(points)) <= side * side / 200);
    NormalOptions many;
    many.k = 32;
    CHECK(missing(estimate_normals(points, many)) == 0);
  }
}

TEST_CASE("no plane, no normal") {
  SUBCASE("fewer than three neighbours") {
    CHECK(missing(estimate_normals(Points(0, 3))) == 0);
    CHECK(missing(estimate_normals(Points(Points::Random(1, 3)))) == 1);
    CHECK(missing(estimate_normals(Points(Points::Random(2, 3)))) == 2);
    Points apart = Points::Random(20, 3);
    apart.topRows(3) << 9, 9, 9, 9, 9, 9.1f, 9, 9.1f, 9;
    NormalOptions options;
    options.max_radius = 1e-6;
    CHECK(missing(estimate_normals(apart, options)) == 20);
    options.max_radius = 0.2;
    CHECK(missing(estimate_normals(Points(apart.topRows(3)), options)) == 0);
  }
  SUBCASE("a line") {
    PointsDouble line(50, 3);
    for (Eigen::Index i = 0; i < line.rows(); ++i)
      line.row(i) = Eigen::RowVector3d(0.1, -0.3, 0.7) * static_cast<double>(i);
    CHECK(missing(estimate_normals(line)) == 50);
    CHECK(missing(estimate_normals(Points(line.cast<float>()))) == 50);
  }
  SUBCASE("one place") { CHECK(missing(estimate_normals(Points(Points::Constant(40, 3, 0.3f)))) == 40); }
  SUBCASE("space") {
    PointsDouble lattice(1000, 3);
    for (Eigen::Index i = 0; i < 1000; ++i)
      lattice.row(i) << static_cast<double>(i % 10), static_cast<double>(i / 10 % 10), static_cast<double>(i / 100);
    NormalOptions options;
    options.k = 27;
    const PointsDouble normals = estimate_normals(lattice, options);
    for (Eigen::Index i = 0; i < 1000; ++i) {
      if (lattice.row(i).minCoeff() > 0 && lattice.row(i).maxCoeff() < 9) CHECK(std::isnan(normals(i, 0)));
    }
  }
  SUBCASE("a rod: two equal least variances") {
    PointsDouble rod(12, 3);
    for (int i = 0; i < 4; ++i) {
      const double angle = 1.5707963267948966 * i;
      for (int j = 0; j < 3; ++j) rod.row(3 * i + j) << j, 0.5 * std::cos(angle), 0.5 * std::sin(angle);
    }
    const PointsDouble normals = estimate_normals(rod);
    for (Eigen::Index i = 0; i < 12; ++i)
      CHECK((std::isnan(normals(i, 0)) || std::abs(normals.row(i).norm() - 1) < 1e-12));
  }
}

TEST_CASE("points that are not finite have no normal and do no harm") {
  Points points = square(20, 0, 5).cast<float>();
  for (Eigen::Index i = 0; i < points.rows(); i += 5) points(i, i % 3) = std::numeric_limits<float>::quiet_NaN();
  const Points normals = estimate_normals(points, {}, Vector3d(0, 0, 1));
  for (Eigen::Index i = 0; i < points.rows(); ++i) CHECK(std::isnan(normals(i, 2)) == (i % 5 == 0));
}

TEST_CASE("the same bits for any number of threads") {
  const Points points = square(150, 0.002, 6).cast<float>();
  NormalOptions one, four;
  one.num_threads = 1;
  four.num_threads = 4;
  const Points a = estimate_normals(points, one), b = estimate_normals(points, four);
  CHECK((a.array() == b.array() || (a.array() != a.array() && b.array() != b.array())).all());
}

TEST_CASE("more neighbours than there are points are all points") {
  Points points(4, 3);
  points << 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1;
  NormalOptions options;
  options.k = 2147483647;
  CHECK(estimate_normals(points, options) ==
        Points(Points::Constant(4, 3, 0.0F) - Points(Eigen::RowVector3f::UnitZ().replicate(4, 1))));
}

TEST_CASE("illegal arguments") {
  const Points points = Points::Random(10, 3);
  NormalOptions options;
  options.k = 2;
  CHECK_THROWS_WITH_AS(estimate_normals(points, options), "k must be at least 3, got 2", std::invalid_argument);
  options = {};
  options.max_radius = 0;
  CHECK_THROWS_AS(estimate_normals(points, options), std::invalid_argument);
  CHECK_THROWS_AS(estimate_normals(points, {}, Vector3d(0, 0, std::nan(""))), std::invalid_argument);
}
