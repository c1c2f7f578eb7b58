/// Triangle meshes: what a simulated camera looks at and what a model is measured against.
#pragma once

#include <cstdint>
#include <memory>

#include "nacre/types.hpp"

namespace nacre {

/// Three vertices a row.
using Triangles = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
using TrianglesRef = Eigen::Ref<const Triangles>;

/// A number for each point.
using PointNumbers = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1>;
/// 1 or 0 for each point.
using PointFlags = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 1>;

using PointsDouble = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using PointsDoubleRef = Eigen::Ref<const PointsDouble>;

/// A triangle mesh.
struct Mesh {
  Points vertices;      ///< [m]
  Triangles triangles;  ///< vertex indices, counter-clockwise seen from outside
};

/// The built-in object, made by formula: a snail with the ears of a rabbit, 0.15 m long, y up, z to its right, looking
/// along +x. Closed, with thin parts (ears, the lip of the shell, the hem of the foot: 3 mm), concavities and no
/// symmetry.
Mesh built_in_object();

/// Triangles that join points with normals, counter-clockwise seen from where the normals point; indices of the points,
/// which are its corners as they are. Where points are farther apart than their neighbours are, as where nothing was
/// seen, it is open. Each edge has one triangle on each side at most. Points that are not finite have none. Normals
/// need not be of unit length. Gopi, Krishnan and Silva 2000. num_threads = 0 uses all; no result depends on it.
Triangles triangulate(const PointsRef& points, const PointsRef& normals, int num_threads = 0);

/// The number of the part that each point is in, from 0 in the order of their first points: points that triangles join
/// are in one part, a point of no triangle is one by itself. Throws std::invalid_argument for indices out of range.
PointNumbers connected_parts(const TrianglesRef& triangles, std::int64_t num_points);

/// Which points of a model are a surface, 1 for each that is, else 0: points that surer ones cover are not (those that
/// have points of higher confidence, on the same side of the surface, on all sides above or below them), nor are those
/// that `triangulate` joins to none of the others or to few. num_threads = 0 uses all; no result depends on it.
PointFlags on_surface(const PointsRef& points, const PointsRef& normals, const ValuesRef& confidence,
                      int num_threads = 0);

/// A bounding volume hierarchy over a mesh; immutable, so any number of threads may ask it. Distances and intersections
/// are computed in double precision from the float vertices.
class MeshTree {
 public:
  /// Throws std::invalid_argument for vertices that are not finite, indices out of range, or no triangle.
  explicit MeshTree(const PointsRef& vertices, const TrianglesRef& triangles);
  ~MeshTree();
  MeshTree(MeshTree&&) noexcept;
  MeshTree& operator=(MeshTree&&) noexcept;

  /// What a ray hit.
  struct Hit {
    double distance = -1.0;  ///< in units of |direction|; negative: nothing was hit
    std::int32_t triangle = -1;
  };
  /// The first triangle hit in front of the origin, from either side; ties by the smaller triangle index. Watertight:
  /// no ray slips between triangles that share vertices. A ray that is not finite, or has no direction, hits nothing.
  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// What rays hit, one a row.
  struct Hits {
    Eigen::VectorXd distances;                                 ///< NaN: nothing was hit
    Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1> triangles;  ///< -1: nothing was hit
  };
  /// One ray a row.
  Hits cast(const PointsDoubleRef& origins, const PointsDoubleRef& directions, int num_threads = 0) const;

  /// The nearest point of the surface.
  struct Closest {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    std::int32_t triangle = -1;
    double distance = 0.0;  ///< unsigned [m]
  };
  /// The point of the surface nearest to a point; NaN and triangle -1 for one that is not finite, or so far off that
  /// its squared distance is not.
  Closest closest(const Eigen::Vector3d& point) const;

  /// The nearest points of the surface, one a row.
  struct ClosestPoints {
    PointsDouble points;
    PointsDouble normals;  ///< of the triangles
    Eigen::VectorXd distances;
    Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1> triangles;
  };
  ClosestPoints closest(const PointsDoubleRef& points, int num_threads = 0) const;

  /// Unit normal of a triangle by the right-hand rule; zero for a degenerate one.
  Eigen::Vector3d normal(std::int32_t triangle) const;

  /// The corners of the box around the triangles.
  const Eigen::Vector3d& lower() const;
  const Eigen::Vector3d& upper() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace nacre
