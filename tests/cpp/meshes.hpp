// Meshes with known geometry.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "nacre/mesh.hpp"

namespace nacre_test {

inline nacre::Mesh to_mesh(const std::vector<Eigen::Vector3d>& vertices,
                           const std::vector<std::array<std::int32_t, 3>>& triangles) {
  nacre::Mesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  mesh.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    mesh.vertices.row(static_cast<Eigen::Index>(i)) = vertices[i].cast<float>().transpose();
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    mesh.triangles.row(static_cast<Eigen::Index>(i)) << triangles[i][0], triangles[i][1], triangles[i][2];
  }
  return mesh;
}

// The parallelogram with these corner and sides.
inline nacre::Mesh quad(const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return to_mesh({corner, corner + a, corner + a + b, corner + b}, {{0, 1, 2}, {0, 2, 3}});
}

inline nacre::Mesh together(const nacre::Mesh& a, const nacre::Mesh& b) {
  nacre::Mesh mesh;
  mesh.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  mesh.vertices << a.vertices, b.vertices;
  mesh.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  mesh.triangles << a.triangles, (b.triangles.array() + static_cast<std::int32_t>(a.vertices.rows())).matrix();
  return mesh;
}

// An octahedron whose faces are divided in four, again and again; the vertices lie on the sphere.
inline nacre::Mesh sphere(const Eigen::Vector3d& center, double radius, int divisions) {
  std::vector<Eigen::Vector3d> vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::int32_t, 3>> triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                        {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int division = 0; division < divisions; ++division) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(vertices.size()));
      if (is_new) {
        vertices.push_back(
            (vertices[static_cast<std::size_t>(a)] + vertices[static_cast<std::size_t>(b)]).normalized());
      }
      return entry->second;
    };
    std::vector<std::array<std::int32_t, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  for (Eigen::Vector3d& vertex : vertices) vertex = center + radius * vertex;
  return to_mesh(vertices, triangles);
}

}  // namespace nacre_test
