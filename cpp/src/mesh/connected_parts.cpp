// Union-find over the corners of triangles.
#include <cstddef>
#include <cstdint>

#include "base/check.hpp"
#include "base/disjoint_sets.hpp"
#include "nacre/mesh.hpp"

namespace nacre {

PointNumbers connected_parts(const TrianglesRef& triangles, std::int64_t num_points) {
  DisjointSets sets(static_cast<std::size_t>(num_points));
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      require(triangles(t, k) >= 0 && triangles(t, k) < num_points, "triangles", "indices of the points",
              triangles(t, k));
    }
    for (int k = 1; k < 3; ++k) sets.join(triangles(t, 0), triangles(t, k));
  }
  std::int32_t num_parts = 0;
  PointNumbers parts(num_points);
  for (std::int32_t i = 0; i < num_points; ++i) {
    const std::int32_t before = sets.first_of(i);
    parts[i] = before == i ? num_parts++ : parts[before];
  }
  return parts;
}

}  // namespace nacre
