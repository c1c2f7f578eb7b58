#include <algorithm>

#include "deformation/node_growth.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

constexpr float spacing = 0.01F;

struct Sheet {
  std::vector<Eigen::Vector3f> points, normals;
  std::vector<std::int32_t> last_seen;

  // Rows of points from one column to another, at a depth.
  void add(int first, int last, float z) {
    for (int row = 0; row < 20; ++row) {
      for (int column = first; column < last; ++column) {
        points.emplace_back(spacing * static_cast<float>(column), spacing * static_cast<float>(row), z);
        normals.emplace_back(0.0F, 0.0F, -1.0F);
        last_seen.push_back(0);
      }
    }
  }
  // densest: the spacing of points somewhere else.
  void grow(WarpField& field, float densest = spacing) const {
    const std::vector<float> spacings(points.size() - field.bindings.size(), spacing);
    nacre::grow(field, {points, normals, spacings, last_seen, 0, static_cast<double>(densest)});
  }
};

WarpField empty_field() {
  WarpField field;
  field.node_spacing = 0.06;
  return field;
}

}  // namespace

TEST_CASE("nodes are a spacing apart, and no point is farther from one") {
  Sheet sheet;
  sheet.add(0, 40, 0.5F);
  WarpField field = empty_field();
  sheet.grow(field);
  CHECK(field.nodes.size() > 20);
  for (std::size_t a = 0; a < field.nodes.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) CHECK((field.nodes[a].rest - field.nodes[b].rest).norm() > 0.05);
  }
  for (std::size_t i = 0; i < sheet.points.size(); ++i) {
    const WarpBinding& binding = field.bindings[i];
    CHECK(binding.count() >= 3);
    CHECK(binding.distances[0] <= 0.06F);
    const Eigen::Vector3d place = field.nodes[static_cast<std::size_t>(binding.nodes[0])].rest;
    CHECK((place - sheet.points[i].cast<double>()).norm() <= static_cast<double>(binding.distances[0]) + 1e-6);
  }
}

TEST_CASE("nodes are farther apart by as much as points are") {
  Sheet sheet;
  sheet.add(0, 40, 0.5F);
  WarpField dense = empty_field(), sparse = empty_field();
  sheet.grow(dense);
  sheet.grow(sparse, 0.5F * spacing);
  CHECK(3 * sparse.nodes.size() < dense.nodes.size());
  for (const WarpBinding& binding : sparse.bindings) CHECK(binding.distances[0] <= 0.12F);
}

TEST_CASE("parts are what shares no nodes") {
  Sheet sheet;
  sheet.add(0, 20, 0.5F);
  WarpField field = empty_field();
  sheet.grow(field);
  const std::size_t num_first = field.nodes.size();
  sheet.add(0, 20, 0.54F);
  sheet.grow(field);
  const std::vector<std::int32_t> parts = parts_of(field);
  for (std::size_t node = 0; node < parts.size(); ++node) {
    CHECK(parts[node] == static_cast<std::int32_t>(node < num_first ? 0 : num_first));
  }
}

TEST_CASE("the nearest along the surface are not the nearest through the air") {
  Sheet sheet;  // two layers, nearer to each other than nodes, that nothing connects
  sheet.add(0, 20, 0.5F);
  sheet.add(0, 20, 0.54F);
  WarpField field = empty_field();
  sheet.grow(field);
  for (std::size_t i = 0; i < sheet.points.size(); ++i) {
    const WarpBinding& binding = field.bindings[i];
    for (int k = 0; k < binding.count(); ++k) {
      const std::int32_t node = binding.nodes[static_cast<std::size_t>(k)];
      CHECK(field.nodes[static_cast<std::size_t>(node)].rest.z() == doctest::Approx(sheet.points[i].z()));
    }
  }
}

TEST_CASE("surface that is added goes on from the nodes that are there") {
  Sheet sheet;
  sheet.add(0, 20, 0.5F);
  WarpField field = empty_field();
  sheet.grow(field);
  const std::size_t num_nodes = field.nodes.size(), num_points = sheet.points.size();
  for (WarpNode& node : field.nodes) node.position.z() += 0.1;  // the sheet has moved
  for (Eigen::Vector3f& point : sheet.points) point.z() += 0.1F;
  sheet.add(20, 40, 0.6F);
  sheet.grow(field);
  CHECK(field.nodes.size() > num_nodes);
  CHECK(field.bindings.size() == sheet.points.size());
  const auto& nodes = field.bindings[num_points].nodes;  // beside the seam
  CHECK(*std::min_element(nodes.begin(), nodes.end()) < static_cast<std::int32_t>(num_nodes));
  for (const WarpNode& node : field.nodes) CHECK(node.rest.z() == doctest::Approx(0.5));  // the canonical sheet is flat
  for (std::size_t i = num_points; i < sheet.points.size(); ++i) {
    const OrientedPoint rest = unwarped(field.at(field.bindings[i]), {sheet.points[i], sheet.normals[i]});
    CHECK(rest.point.z() == doctest::Approx(0.5).epsilon(1e-5));
  }
}

TEST_CASE("every node is connected with an earlier one, islands too") {
  Sheet sheet;
  sheet.add(0, 10, 0.5F);
  sheet.add(30, 40, 0.7F);
  WarpField field = empty_field();
  sheet.grow(field);
  for (std::int32_t node = 1; node < static_cast<std::int32_t>(field.nodes.size()); ++node) {
    CHECK(
        std::any_of(field.edges.begin(), field.edges.end(), [&](const WarpEdge& edge) { return edge.second == node; }));
  }
}
