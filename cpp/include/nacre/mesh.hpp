/// Triangle meshes: what a simulated camera looks at and what a model is measured against.
#pragma once

#include <cstdint>
#include <memory>

#include "nacre/types.hpp"

namespace nacre {

using Triangles = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
using TrianglesRef = Eigen::Ref<const Triangles>;

struct Mesh {
  Points vertices;      ///< [m]
  Triangles triangles;  ///< vertex indices
};

/// The built-in object, made by formula: bunny-sized (0.15 m), with thin parts and concavities, closed, y up.
Mesh built_in_object();

/// A bounding volume hierarchy over a mesh; immutable.
class MeshTree {
 public:
  /// Throws std::invalid_argument for vertices that are not finite, indices out of range, or no triangle.
  explicit MeshTree(const PointsRef& vertices, const TrianglesRef& triangles);
  ~MeshTree();
  MeshTree(MeshTree&&) noexcept;
  MeshTree& operator=(MeshTree&&) noexcept;

  struct Hit {
    double distance = -1.0;  ///< in units of |direction|; negative: nothing was hit
    std::int32_t triangle = -1;
  };
  /// The first triangle hit in front of the origin, from either side; ties by the smaller triangle index.
  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  struct Closest {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    std::int32_t triangle = -1;
    double distance = 0.0;  ///< unsigned [m]
  };
  Closest closest(const Eigen::Vector3d& point) const;

  /// Unit normal of a triangle by the right-hand rule; zero for a degenerate one.
  Eigen::Vector3d normal(std::int32_t triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace nacre
