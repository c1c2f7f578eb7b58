#include <cmath>
#include <set>
#include <utility>

#include "doctest/doctest.h"
#include "nacre/mesh.hpp"

using namespace nacre;

namespace {

struct Surface {
  Points points, normals;
};

// A Fibonacci lattice.
Surface sphere(int size) {
  Surface result{Points(size, 3), Points(size, 3)};
  for (int i = 0; i < size; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / size, ring = std::sqrt(1.0 - z * z);
    const double angle = M_PI * (1.0 + std::sqrt(5.0)) * (i + 0.5);
    const Eigen::Vector3d normal(ring * std::cos(angle), ring * std::sin(angle), z);
    result.normals.row(i) = normal.cast<float>().transpose();
    result.points.row(i) = 0.1F * result.normals.row(i);
  }
  return result;
}

// Of a plane, in rows half a step aside; without those within a distance of its middle.
Surface sheet(double left_out) {
  Surface result{Points(1600, 3), Points(1600, 3)};
  Eigen::Index size = 0;
  for (int row = 0; row < 40; ++row) {
    for (int col = 0; col < 40; ++col) {
      const Eigen::Vector2d place(col + 0.5 * (row % 2), 0.866 * row);
      if ((place - Eigen::Vector2d(20.0, 17.32)).norm() < left_out) continue;
      result.points.row(size) << static_cast<float>(place.x()), static_cast<float>(place.y()), 0.0F;
      result.normals.row(size++) << 0.0F, 0.0F, 1.0F;
    }
  }
  return {result.points.topRows(size), result.normals.topRows(size)};
}

// Edges that have one triangle, and whose middle is within a distance of the sheet's.
int borders(const Surface& surface, double distance) {
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  const Triangles triangles = triangulate(surface.points, surface.normals);
  for (Eigen::Index i = 0; i < triangles.rows(); ++i) {
    for (int k = 0; k < 3; ++k) CHECK(edges.emplace(triangles(i, k), triangles(i, (k + 1) % 3)).second);
  }
  int count = 0;
  for (const auto& [from, to] : edges) {
    const Eigen::Vector3f middle = 0.5F * (surface.points.row(from) + surface.points.row(to)).transpose();
    if ((middle - Eigen::Vector3f(20.0F, 17.32F, 0.0F)).norm() < distance)
      count += edges.count({to, from}) == 0 ? 1 : 0;
  }
  return count;
}

}  // namespace

TEST_CASE("an even sphere is closed, two triangles a point") {
  const Surface surface = sphere(3000);
  const Triangles triangles = triangulate(surface.points, surface.normals);
  CHECK(triangles.rows() == 2 * 3000 - 4);
  for (Eigen::Index i = 0; i < triangles.rows(); ++i) {
    const auto corner = [&](int k) { return Eigen::Vector3f(surface.points.row(triangles(i, k)).transpose()); };
    const Eigen::Vector3f normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    CHECK(normal.dot(corner(0).normalized()) > 0.99F);
  }
}

TEST_CASE("small holes are closed, larger ones stay") {
  CHECK(borders(sheet(0.0), 12.0) == 0);
  CHECK(borders(sheet(0.6), 12.0) == 0);  // a point missing
  CHECK(borders(sheet(1.1), 12.0) == 0);  // seven
  CHECK(borders(sheet(6.0), 12.0) > 30);
}

TEST_CASE("what makes no surface has no triangle") {
  CHECK(triangulate(Points(0, 3), Points(0, 3)).rows() == 0);
  CHECK(triangulate(Points::Zero(50, 3), Points::Ones(50, 3)).rows() == 0);
  CHECK(triangulate(Points::Random(50, 3), Points::Zero(50, 3)).rows() == 0);
  CHECK(triangulate(sheet(0.0).points, Points::Constant(1600, 3, std::nanf(""))).rows() == 0);
  CHECK_THROWS_WITH_AS(triangulate(Points::Zero(5, 3), Points::Zero(4, 3)), doctest::Contains("normals"),
                       std::invalid_argument);
}
