#include <cmath>

#include "clouds.hpp"
#include "doctest/doctest.h"
#include "registration/dominant_planes.hpp"

using namespace nacre;

namespace {

constexpr double noise = 1e-3, largest = 4e-3;
constexpr int count = 2000;

// A match, with noise along the normal and in it.
Pair pair_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, std::uint64_t i) {
  Pair pair{};
  pair.q = point + noise * random_normal(7, i) * normal;
  pair.p = pair.q;
  pair.normal = (normal + 0.1 * random_direction(8, i)).normalized();
  pair.largest_residual = largest;
  return pair;
}

// Sides of a box of 0.2 m; the last part of them 0.1 m off all sides.
std::vector<Pair> corner(int num_sides, double part_off = 0.0) {
  const Pose tilted(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 3.0).normalized()));
  std::vector<Pair> pairs;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::uint64_t>(i);
    const int side = static_cast<int>(random_uniform(5, k) * num_sides), axis = side % 3;
    Eigen::Vector3d point(0.2 * random_uniform(1, k), 0.2 * random_uniform(2, k), 0.2 * random_uniform(3, k));
    point[axis] = side < 3 ? 0.0 : 0.2;
    if (i >= (1.0 - part_off) * count) point = Eigen::Vector3d(0.3, 0.3, 0.3) + 0.1 * random_direction(4, k);
    pairs.push_back(pair_at(tilted * point, tilted.linear() * Eigen::Vector3d::Unit(axis), k));
  }
  return pairs;
}

std::vector<Pair> sphere() {
  const OrientedCloud cloud = sphere_cloud(count, 2);
  std::vector<Pair> pairs;
  for (int i = 0; i < count; ++i) {
    pairs.push_back(pair_at(cloud.points.row(i).transpose().cast<double>(),
                            cloud.normals.row(i).transpose().cast<double>(), static_cast<std::uint64_t>(i)));
  }
  return pairs;
}

constexpr double ratio = noise / largest;

}  // namespace

TEST_CASE("a plane, an edge and a corner leave nothing off three planes") {
  for (const int num_sides : {1, 2, 3}) CHECK(share_off_planes(corner(num_sides), ratio) < 0.01);
}

TEST_CASE("what stands before a corner is off it, as are the other sides of a box") {
  for (const double part : {0.05, 0.2, 0.5}) {
    CHECK(share_off_planes(corner(3, part), ratio) == doctest::Approx(part).epsilon(0.3));
  }
  CHECK(share_off_planes(corner(4), ratio) == doctest::Approx(0.25).epsilon(0.15));
  CHECK(share_off_planes(corner(6), ratio) == doctest::Approx(0.5).epsilon(0.15));
}

TEST_CASE("a round shape is off all planes, unless noise is as large") {
  CHECK(share_off_planes(sphere(), ratio) > 0.6);
  CHECK(share_off_planes(sphere(), 0.1 * ratio) > share_off_planes(sphere(), ratio));
  std::vector<Pair> coarse = sphere();
  for (Pair& pair : coarse) pair.largest_residual = 0.1;
  CHECK(share_off_planes(coarse, 1.0) == 0.0);
}

TEST_CASE("no matches, and too few for a plane") {
  CHECK(share_off_planes({}, 0.1) == 0.0);
  const std::vector<Pair> all = sphere();
  CHECK(share_off_planes({all[0], all[1], all[2]}, 0.1) == 0.0);
}
