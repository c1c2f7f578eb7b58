// A mesh of the zero level of a function by surface nets (Gibson 1998), with one vertex for each patch of the surface
// in a grid cell, not for each cell, so that thin sheets stay manifold (dual marching cubes, Nielson 2004). One quad
// for each grid edge that the surface crosses.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.hpp"
#include "nacre/mesh.hpp"

namespace nacre {

// The function is negative inside. The surface must lie within the box.
template <class Function>
class SurfaceNets {
 public:
  using Vector3d = Eigen::Vector3d;

  SurfaceNets(const Function& function, const Vector3d& lower, const Vector3d& upper, double cell)
      : function_(function), lower_(lower), cell_(cell) {
    size_ = ((upper - lower) / cell).array().ceil().template cast<std::int64_t>() + 1;
    values_.resize(static_cast<std::size_t>(size_.prod()));
    parallel_for(size_[2], 1, 0, [&](std::int64_t z) {
      for (std::int64_t y = 0; y < size_[1]; ++y) {
        for (std::int64_t x = 0; x < size_[0]; ++x) values_[at({x, y, z})] = function_(position({x, y, z}));
      }
    });
  }

  Mesh mesh() {
    place_vertices();
    join_vertices();
    for (int pass = 0; pass < 5; ++pass) relax();
    split_quads();

    Mesh mesh;
    mesh.vertices.resize(static_cast<Eigen::Index>(vertices_.size()), 3);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      mesh.vertices.row(static_cast<Eigen::Index>(i)) = vertices_[i].template cast<float>().transpose();
    }
    mesh.triangles =
        Eigen::Map<const Triangles>(triangles_.data(), static_cast<Eigen::Index>(triangles_.size() / 3), 3);
    return mesh;
  }

 private:
  using Cell = Eigen::Array<std::int64_t, 3, 1>;
  using Quad = std::array<std::uint32_t, 4>;  // vertices, counter-clockwise seen from outside

  struct Patches {
    std::uint32_t first = 0;                 // vertex of patch 0; the others follow
    std::array<std::uint8_t, 12> of_edge{};  // the patch that crosses an edge of the cell
  };

  std::size_t at(const Cell& c) const { return static_cast<std::size_t>((c[2] * size_[1] + c[1]) * size_[0] + c[0]); }
  Vector3d position(const Cell& c) const { return lower_ + cell_ * c.matrix().template cast<double>(); }
  bool inside(const Cell& c) const { return values_[at(c)] < 0.0; }

  // The edges of a cell: four along each axis, by their place along the next axis and the one after it.
  static std::size_t edge_index(int axis, int next, int after) {
    return static_cast<std::size_t>(4 * axis + next + 2 * after);
  }
  static Cell corner(const Cell& cell, int axis, int along, int next, int after) {
    Cell corner = cell;
    corner[axis] += along;
    corner[(axis + 1) % 3] += next;
    corner[(axis + 2) % 3] += after;
    return corner;
  }

  template <class Body>
  void for_each_cell(Body&& body) const {
    for (std::int64_t z = 0; z + 1 < size_[2]; ++z) {
      for (std::int64_t y = 0; y + 1 < size_[1]; ++y) {
        for (std::int64_t x = 0; x + 1 < size_[0]; ++x) body(Cell(x, y, z));
      }
    }
  }

  bool is_crossed(const Cell& cell) const {
    int count = 0;
    for (int i = 0; i < 8; ++i) count += inside(corner(cell, 0, i & 1, (i >> 1) & 1, i >> 2));
    return count != 0 && count != 8;
  }

  // Numbers the patches of a cell: edges that a patch crosses are linked through the faces of the cell. Where a face
  // has four crossings, they are linked around its inside corners, which both cells of the face see alike.
  int find_patches(const Cell& cell, std::array<std::uint8_t, 12>& of_edge) const {
    std::array<std::uint8_t, 12> label;
    for (std::size_t i = 0; i < 12; ++i) label[i] = static_cast<std::uint8_t>(i);
    const auto link = [&](std::size_t a, std::size_t b) {
      const std::uint8_t from = std::max(label[a], label[b]), to = std::min(label[a], label[b]);
      std::replace(label.begin(), label.end(), from, to);
    };
    std::array<bool, 12> crossed{};
    for (int axis = 0; axis < 3; ++axis) {
      const int next = (axis + 1) % 3, after = (axis + 2) % 3;
      for (int side = 0; side < 2; ++side) {
        // Around the face: corner i lies between the edges i - 1 and i.
        const std::array<bool, 4> in = {inside(corner(cell, axis, side, 0, 0)), inside(corner(cell, axis, side, 1, 0)),
                                        inside(corner(cell, axis, side, 1, 1)), inside(corner(cell, axis, side, 0, 1))};
        const std::array<std::size_t, 4> edge = {edge_index(next, 0, side), edge_index(after, side, 1),
                                                 edge_index(next, 1, side), edge_index(after, side, 0)};
        std::vector<std::size_t> crossings;
        for (std::size_t i = 0; i < 4; ++i) {
          if (in[i] != in[(i + 1) % 4]) crossings.push_back(edge[i]);
        }
        for (const std::size_t e : crossings) crossed[e] = true;
        if (crossings.size() == 2) link(crossings[0], crossings[1]);
        if (crossings.size() == 4) {
          for (std::size_t i = 0; i < 4; ++i) {
            if (in[i]) link(edge[(i + 3) % 4], edge[i]);
          }
        }
      }
    }
    int count = 0;
    for (std::size_t i = 0; i < 12; ++i) {
      if (crossed[i]) of_edge[i] = static_cast<std::uint8_t>(label[i] == i ? count++ : of_edge[label[i]]);
    }
    return count;
  }

  // At the mean of the crossings of each patch.
  void place_vertices() {
    patches_.resize(values_.size());
    for_each_cell([&](const Cell& cell) {
      if (!is_crossed(cell)) return;
      Patches& patches = patches_[at(cell)];
      patches.first = static_cast<std::uint32_t>(vertices_.size());
      const int count = find_patches(cell, patches.of_edge);
      std::array<Vector3d, 4> sums;
      std::array<int, 4> crossings{};
      sums.fill(Vector3d::Zero());
      for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < 4; ++i) {
          const Cell from = corner(cell, axis, 0, i & 1, i >> 1), to = corner(cell, axis, 1, i & 1, i >> 1);
          if (inside(from) == inside(to)) continue;
          const double a = values_[at(from)], b = values_[at(to)];
          const std::size_t patch = patches.of_edge[edge_index(axis, i & 1, i >> 1)];
          sums[patch] += position(from) + (a / (a - b)) * (position(to) - position(from));
          ++crossings[patch];
        }
      }
      for (std::size_t patch = 0; patch < static_cast<std::size_t>(count); ++patch) {
        vertices_.push_back(sums[patch] / crossings[patch]);
      }
    });
  }

  void join_vertices() {
    for_each_cell([&](const Cell& cell) {
      for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3, after = (axis + 2) % 3;
        if (inside(cell) == inside(corner(cell, axis, 1, 0, 0)) || cell[next] == 0 || cell[after] == 0) continue;
        const auto vertex = [&](int back_next, int back_after) {
          const Patches& patches = patches_[at(corner(cell, axis, 0, -back_next, -back_after))];
          return patches.first + patches.of_edge[edge_index(axis, back_next, back_after)];
        };
        Quad quad{vertex(1, 1), vertex(0, 1), vertex(0, 0), vertex(1, 0)};
        if (!inside(cell)) std::swap(quad[1], quad[3]);
        quads_.push_back(quad);
      }
    });
  }

  // Each vertex half way to the mean of its neighbours, then back onto the surface: even triangles, smooth rims.
  void relax() {
    std::vector<Vector3d> sums(vertices_.size(), Vector3d::Zero());
    std::vector<int> counts(vertices_.size(), 0);
    for (const Quad& quad : quads_) {
      for (std::size_t i = 0; i < 4; ++i) {
        sums[quad[i]] += vertices_[quad[(i + 1) % 4]];
        ++counts[quad[i]];
      }
    }
    parallel_for(static_cast<std::int64_t>(vertices_.size()), 256, 0, [&](std::int64_t i) {
      const auto vertex = static_cast<std::size_t>(i);
      vertices_[vertex] = 0.5 * (vertices_[vertex] + sums[vertex] / counts[vertex]);
      move_to_surface(vertices_[vertex]);
    });
  }

  // One Newton step along the gradient, at most a quarter of a cell.
  void move_to_surface(Vector3d& vertex) const {
    const double h = 1e-4 * cell_, value = function_(vertex);
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) gradient[axis] = (function_(vertex + h * Vector3d::Unit(axis)) - value) / h;
    const Vector3d move = -value / (gradient.squaredNorm() + 1e-12) * gradient;
    vertex += move * std::min(1.0, 0.25 * cell_ / (move.norm() + 1e-12));
  }

  // Along the shorter diagonal.
  void split_quads() {
    for (const Quad& q : quads_) {
      const auto length = [&](std::size_t a, std::size_t b) {
        return (vertices_[q[a]] - vertices_[q[b]]).squaredNorm();
      };
      const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
        for (const std::size_t i : {a, b, c}) triangles_.push_back(static_cast<std::int32_t>(q[i]));
      };
      if (length(0, 2) <= length(1, 3)) {
        add(0, 1, 2);
        add(0, 2, 3);
      } else {
        add(0, 1, 3);
        add(1, 2, 3);
      }
    }
  }

  const Function& function_;
  Vector3d lower_;
  double cell_;
  Cell size_;
  std::vector<double> values_;
  std::vector<Patches> patches_;
  std::vector<Vector3d> vertices_;
  std::vector<Quad> quads_;
  std::vector<std::int32_t> triangles_;
};

}  // namespace nacre
