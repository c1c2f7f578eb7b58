#include <vector>

#include "doctest/doctest.h"
#include "nacre/mesh.hpp"

using namespace nacre;

namespace {

struct Model {
  std::vector<Eigen::Vector3f> points, normals;
  std::vector<float> confidence;

  // A square of a plane, one apart, in rows half a step aside; its number of points.
  int add_sheet(int side, const Eigen::Vector3f& corner, float up, float sure) {
    for (int row = 0; row < side; ++row) {
      for (int col = 0; col < side; ++col) {
        const float x = static_cast<float>(col) + 0.5F * static_cast<float>(row % 2);
        points.push_back(corner + Eigen::Vector3f(x, 0.866F * static_cast<float>(row), 0.0F));
        normals.emplace_back(0.0F, 0.0F, up);
        confidence.push_back(sure);
      }
    }
    return side * side;
  }

  // How many of the points from one on are a surface.
  int count(int begin, int size) const {
    const auto rows = static_cast<Eigen::Index>(points.size());
    Points all(rows, 3), directions(rows, 3);
    Values sure(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      all.row(i) = points[static_cast<std::size_t>(i)].transpose();
      directions.row(i) = normals[static_cast<std::size_t>(i)].transpose();
      sure(i) = confidence[static_cast<std::size_t>(i)];
    }
    const PointFlags flags = on_surface(all, directions, sure);
    CHECK((flags.array() == on_surface(all, directions, sure, 1).array()).all());
    return flags.segment(begin, size).cast<int>().sum();
  }
};

}  // namespace

TEST_CASE("of two layers that face one way the surer one stays, whichever is above") {
  for (const float height : {-2.0F, 0.8F, 3.0F}) {
    Model model;
    const int sheet = model.add_sheet(30, {0.0F, 0.0F, 0.0F}, 1.0F, 10.0F);
    const int layer = model.add_sheet(6, {12.3F, 11.2F, height}, 1.0F, 1.0F);
    CHECK(model.count(0, sheet) == sheet);
    CHECK(model.count(sheet, layer) == 0);
  }
}

TEST_CASE("both sides of something thin stay, and so does what is beside, or far behind") {
  Model model;
  const int sheet = model.add_sheet(30, {0.0F, 0.0F, 0.0F}, 1.0F, 10.0F);
  const int reverse = model.add_sheet(30, {0.2F, 0.3F, -1.0F}, -1.0F, 1.0F);
  const int beside = model.add_sheet(10, {32.0F, 5.0F, 2.0F}, 1.0F, 1.0F);
  const int behind = model.add_sheet(10, {8.0F, 8.0F, -20.0F}, 1.0F, 1.0F);
  CHECK(model.count(0, sheet + reverse + beside + behind) == sheet + reverse + beside + behind);
}

TEST_CASE("litter is no surface, nor is a point whose normal contradicts") {
  Model model;
  const int sheet = model.add_sheet(30, {0.0F, 0.0F, 0.0F}, 1.0F, 1.0F);
  const int litter = model.add_sheet(5, {60.0F, 0.0F, 0.0F}, 1.0F, 10.0F);
  const int part = model.add_sheet(6, {0.0F, 60.0F, 0.0F}, 1.0F, 10.0F);
  model.normals[435] = {1.0F, 0.0F, 0.0F};
  CHECK(model.count(0, sheet) == sheet - 1);
  CHECK(model.count(sheet, litter) == 0);
  CHECK(model.count(sheet + litter, part) == part);
}

TEST_CASE("nothing is no surface") {
  CHECK(on_surface(Points(0, 3), Points(0, 3), Values(0)).size() == 0);
  CHECK(on_surface(Points::Zero(50, 3), Points::Ones(50, 3), Values::Ones(50)).sum() == 0);
  CHECK_THROWS_WITH_AS(on_surface(Points::Zero(5, 3), Points::Zero(4, 3), Values::Zero(5)),
                       doctest::Contains("normals"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(on_surface(Points::Zero(5, 3), Points::Zero(5, 3), Values::Zero(4)),
                       doctest::Contains("confidence"), std::invalid_argument);
}

TEST_CASE("parts are numbered in the order of their first points") {
  Triangles triangles(3, 3);
  triangles << 5, 1, 3, 4, 2, 6, 3, 7, 5;
  PointNumbers expected(8);
  expected << 0, 1, 2, 1, 2, 1, 2, 1;
  CHECK(connected_parts(triangles, 8) == expected);
  CHECK_THROWS_WITH_AS(connected_parts(triangles, 7), doctest::Contains("triangles"), std::invalid_argument);
}
