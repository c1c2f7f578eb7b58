#include <limits>
#include <map>
#include <set>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "meshes.hpp"
#include "nacre/mesh.hpp"

using Eigen::Vector3d;
using nacre::Mesh;
using nacre::MeshTree;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Vector3d random_point(std::uint64_t seed, std::uint64_t index) {
  return {nacre::random_uniform(seed, 3 * index) - 0.5, nacre::random_uniform(seed, 3 * index + 1) - 0.5,
          nacre::random_uniform(seed, 3 * index + 2) - 0.5};
}

// Triangles at random, some of them without area.
Mesh soup(std::int32_t count) {
  Mesh mesh;
  mesh.vertices.resize(3 * count, 3);
  mesh.triangles.resize(count, 3);
  for (std::int32_t i = 0; i < count; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const Vector3d center = random_point(1, index);
    for (std::int32_t corner = 0; corner < 3; ++corner) {
      const bool collapsed = i % 10 == 0 && corner > 0;
      const Vector3d offset = 0.2 * random_point(2, 3 * index + (collapsed ? 1 : static_cast<std::uint64_t>(corner)));
      mesh.vertices.row(3 * i + corner) = (center + offset).cast<float>().transpose();
      mesh.triangles(i, corner) = 3 * i + corner;
    }
  }
  return mesh;
}

Vector3d corner(const Mesh& mesh, Eigen::Index triangle, int index) {
  return mesh.vertices.row(mesh.triangles(triangle, index)).transpose().cast<double>();
}

// The intersection by Cramer's rule.
double cast_by_hand(const Mesh& mesh, Eigen::Index triangle, const Vector3d& origin, const Vector3d& direction) {
  const Vector3d a = corner(mesh, triangle, 0);
  Eigen::Matrix3d system;
  system << corner(mesh, triangle, 1) - a, corner(mesh, triangle, 2) - a, -direction;
  if (std::abs(system.determinant()) < 1e-14) return not_a_number;
  const Vector3d solution = system.partialPivLu().solve(origin - a);
  const bool inside = solution[0] >= 0.0 && solution[1] >= 0.0 && solution[0] + solution[1] <= 1.0;
  return inside && solution[2] > 0.0 ? solution[2] : not_a_number;
}

}  // namespace

TEST_CASE("rays find what a search through all triangles finds") {
  const Mesh mesh = soup(400);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  int num_hits = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const Vector3d origin = 2.0 * random_point(3, i), direction = random_point(4, i);
    double nearest = not_a_number;
    Eigen::Index triangle = -1;
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      const double distance = cast_by_hand(mesh, t, origin, direction);
      if (std::isnan(distance) || distance >= nearest) continue;
      nearest = distance;
      triangle = t;
    }
    const MeshTree::Hit hit = tree.cast(origin, direction);
    REQUIRE(hit.triangle == triangle);
    if (triangle < 0) continue;
    ++num_hits;
    CHECK(hit.distance == doctest::Approx(nearest).epsilon(1e-9));
  }
  CHECK(num_hits > 150);
}

TEST_CASE("the closest point is the best of all triangles' points") {
  const Mesh mesh = soup(300);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  for (std::uint64_t i = 0; i < 500; ++i) {
    const Vector3d point = 2.0 * random_point(5, i);
    const MeshTree::Closest found = tree.closest(point);
    CHECK((found.point - point).norm() == doctest::Approx(found.distance).epsilon(1e-12));
    // No point of a fine grid over any triangle is nearer, and the nearest of them is not much farther.
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      const Vector3d a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
      for (int u = 0; u <= 20; ++u) {
        for (int v = 0; u + v <= 20; ++v) {
          nearest = std::min(nearest, (a + (u * (b - a) + v * (c - a)) / 20.0 - point).norm());
        }
      }
    }
    CHECK(found.distance <= nearest + 1e-12);
    CHECK(found.distance > nearest - 0.02);
  }
}

TEST_CASE("the closest point of one triangle, region by region") {
  const Mesh mesh = nacre_test::to_mesh({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}});
  const MeshTree tree(mesh.vertices, mesh.triangles);
  CHECK(tree.closest({1, 1, 3}).point == Vector3d(1, 1, 0));
  CHECK(tree.closest({2, -3, 4}).point == Vector3d(2, 0, 0));
  CHECK(tree.closest({2, -3, 4}).distance == 5.0);
  CHECK(tree.closest({-1, -2, 0}).point == Vector3d(0, 0, 0));
  CHECK(tree.closest({9, -1, 0}).point == Vector3d(4, 0, 0));
  CHECK((tree.closest({4, 4, 1}).point - Vector3d(2, 2, 0)).norm() < 1e-15);
  CHECK(std::isnan(tree.closest({not_a_number, 0, 0}).distance));
  CHECK(tree.closest({not_a_number, 0, 0}).triangle == -1);
  CHECK(tree.normal(0) == Vector3d(0, 0, 1));
}

TEST_CASE("no ray leaves a closed mesh through an edge or a vertex") {
  const auto check = [](const Mesh& mesh, const Vector3d& inside, bool is_convex) {
    const MeshTree tree(mesh.vertices, mesh.triangles);
    int num_leaks = 0;
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      for (int i = 0; i < 3; ++i) {
        const Vector3d a = corner(mesh, t, i), b = corner(mesh, t, (i + 1) % 3);
        for (const double s : {0.0, 0.25, 0.5, nacre::random_uniform(6, static_cast<std::uint64_t>(3 * t + i))}) {
          const Vector3d target = a + s * (b - a);
          const MeshTree::Hit hit = tree.cast(inside, target - inside);
          if (hit.triangle < 0 || (is_convex && hit.distance > 1.0 + 1e-12)) ++num_leaks;
        }
      }
    }
    CHECK(num_leaks == 0);
  };
  check(nacre_test::sphere({0, 0, 0}, 1.0, 4), {0, 0, 0}, true);
  check(nacre_test::sphere({0, 0, 0}, 1.0, 4), {0.25, 0.5, 0.125}, true);
  check(nacre_test::sphere({0.3, -5.1, 7.7}, 0.13, 5), {0.31, -5.13, 7.71}, true);
  check(nacre::built_in_object(), {0.0, 0.012, -0.004}, false);
}

TEST_CASE("rays along the axes, within the planes of the triangles' boxes") {
  const Mesh mesh = nacre_test::sphere({0, 0, 0}, 1.0, 3);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Vector3d direction = sign * Vector3d::Unit(axis);
      CHECK(tree.cast(-3.0 * direction, direction).distance == doctest::Approx(2.0).epsilon(1e-7));
      CHECK(tree.cast(Vector3d::Zero(), direction).distance == doctest::Approx(1.0).epsilon(1e-7));
      CHECK(tree.cast(3.0 * direction, direction).triangle == -1);
    }
  }
}

TEST_CASE("equal hits go to the smaller index; misuse of rays hits nothing") {
  const Mesh square = nacre_test::quad({0, 0, 1}, {1, 0, 0}, {0, 1, 0});
  const Mesh twice = nacre_test::together(square, square);
  const MeshTree tree(twice.vertices, twice.triangles);
  CHECK(tree.cast({0.5, 0.25, 0}, {0, 0, 1}).triangle == 0);
  CHECK(tree.cast({0.25, 0.5, 0}, {0, 0, 1}).triangle == 1);
  CHECK(tree.cast({0.5, 0.5, 0}, {0, 0, 1}).triangle == 0);
  CHECK(tree.cast({0.5, 0.25, 0}, {0, 0, 4}).distance == 0.25);
  CHECK(tree.cast({0.5, 0.25, 1}, {0, 0, 1}).triangle == -1);
  CHECK(tree.cast({0.5, 0.25, 0}, {0, 0, 0}).triangle == -1);
  CHECK(tree.cast({not_a_number, 0.25, 0}, {0, 0, 1}).triangle == -1);
  CHECK(tree.cast({0.5, 0.25, 0}, {0, not_a_number, 1}).triangle == -1);
}

TEST_CASE("many equal triangles, and many of growing size, still make a tree") {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (std::int32_t i = 0; i < 300; ++i) {
    const double size = i < 100 ? 1.0 : std::pow(2.0, 0.3 * (i - 100)) * 1e-12;
    const double z = i < 100 ? 1.0 : 2.0 + size;
    vertices.insert(vertices.end(), {{size, 0, z}, {2 * size, 0, z}, {size, size, z}});
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const Mesh mesh = nacre_test::to_mesh(vertices, triangles);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  CHECK(tree.cast({1.25, 0.25, 0}, {0, 0, 1}).triangle == 0);
  CHECK(tree.closest({1.25, 0.25, 0.999}).distance == doctest::Approx(0.001).epsilon(1e-6));
}

TEST_CASE("batches give the same bits for any number of threads") {
  const Mesh mesh = soup(500);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  nacre::PointsDouble origins(5000, 3), directions(5000, 3);
  for (Eigen::Index i = 0; i < origins.rows(); ++i) {
    origins.row(i) = 2.0 * random_point(7, static_cast<std::uint64_t>(i)).transpose();
    directions.row(i) = random_point(8, static_cast<std::uint64_t>(i)).transpose();
  }
  origins(17, 1) = not_a_number;
  const MeshTree::Hits one = tree.cast(origins, directions, 1);
  const MeshTree::ClosestPoints near_one = tree.closest(origins, 1);
  CHECK(std::isnan(one.distances[17]));
  CHECK(std::isnan(near_one.normals(17, 0)));
  for (const int threads : {2, 3, 8}) {
    const MeshTree::Hits many = tree.cast(origins, directions, threads);
    CHECK(many.triangles == one.triangles);
    CHECK((many.distances.array() == one.distances.array() || one.distances.array().isNaN()).all());
    const MeshTree::ClosestPoints near_many = tree.closest(origins, threads);
    CHECK(near_many.triangles == near_one.triangles);
    CHECK((near_many.points.array() == near_one.points.array() || near_one.points.array().isNaN()).all());
  }
}

TEST_CASE("meshes that are none are refused") {
  const Mesh square = nacre_test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  nacre::Triangles wrong = square.triangles;
  CHECK_THROWS_AS(MeshTree(square.vertices, nacre::Triangles(0, 3)), std::invalid_argument);
  wrong(1, 2) = 4;
  CHECK_THROWS_AS(MeshTree(square.vertices, wrong), std::invalid_argument);
  wrong(1, 2) = -1;
  CHECK_THROWS_AS(MeshTree(square.vertices, wrong), std::invalid_argument);
  nacre::Points vertices = square.vertices;
  vertices(0, 0) = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS(MeshTree(vertices, square.triangles), std::invalid_argument);
}

TEST_CASE("the built-in object is one closed surface, oriented outwards, with thin parts") {
  const Mesh mesh = nacre::built_in_object();
  std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
  double volume = 0.0, area = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    for (int i = 0; i < 3; ++i) ++edges[{mesh.triangles(t, i), mesh.triangles(t, (i + 1) % 3)}];
    const Vector3d a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
    volume += a.dot(b.cross(c)) / 6.0;
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  bool is_closed = true;
  for (const auto& [edge, count] : edges) {
    is_closed = is_closed && count == 1 && edges.count({edge.second, edge.first}) == 1;
  }
  CHECK(is_closed);
  CHECK(mesh.vertices.rows() - static_cast<Eigen::Index>(edges.size()) / 2 + mesh.triangles.rows() == 2);

  // At each vertex the triangles form one ring: following them from edge to edge meets all of them.
  std::vector<std::map<std::int32_t, std::int32_t>> next(static_cast<std::size_t>(mesh.vertices.rows()));
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    for (int i = 0; i < 3; ++i) {
      next[static_cast<std::size_t>(mesh.triangles(t, i))][mesh.triangles(t, (i + 1) % 3)] =
          mesh.triangles(t, (i + 2) % 3);
    }
  }
  bool is_manifold = true;
  for (const auto& ring : next) {
    REQUIRE(!ring.empty());
    std::size_t length = 0;
    std::int32_t at = ring.begin()->first;
    do {
      at = ring.at(at);
      ++length;
    } while (at != ring.begin()->first && length <= ring.size());
    is_manifold = is_manifold && length == ring.size();
  }
  CHECK(is_manifold);

  CHECK(mesh.triangles.rows() > 20000);
  CHECK(mesh.triangles.rows() < 80000);
  CHECK(volume == doctest::Approx(195e-6).epsilon(0.01));
  CHECK(area == doctest::Approx(0.0403).epsilon(0.01));
  const Vector3d size =
      (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).transpose().cast<double>();
  CHECK(size.maxCoeff() == doctest::Approx(0.15).epsilon(0.05));
  CHECK(size.minCoeff() > 0.06);

  // Thickness: from the middle of a triangle straight inwards to the other side.
  const MeshTree tree(mesh.vertices, mesh.triangles);
  int num_thin = 0, num_thinner = 0;
  for (std::int32_t t = 0; t < mesh.triangles.rows(); ++t) {
    const Vector3d inwards = -tree.normal(t);
    const Vector3d middle = (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3.0;
    const MeshTree::Hit hit = tree.cast(middle + 1e-7 * inwards, inwards);
    if (hit.triangle < 0) continue;
    num_thin += hit.distance > 0.002 && hit.distance < 0.004;
    num_thinner += hit.distance < 0.002;
  }
  CHECK(num_thin > 0.1 * static_cast<double>(mesh.triangles.rows()));
  CHECK(num_thinner < 0.01 * static_cast<double>(mesh.triangles.rows()));

  const Mesh again = nacre::built_in_object();
  CHECK(again.vertices == mesh.vertices);
  CHECK(again.triangles == mesh.triangles);
}
