// Union-find over the corners of triangles.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/check.hpp"
#include "nacre/mesh.hpp"

namespace nacre {

PointNumbers connected_parts(const TrianglesRef& triangles, std::int64_t num_points) {
  std::vector<std::int32_t> first(static_cast<std::size_t>(num_points));  // a point of the same part before each
  for (std::size_t i = 0; i < first.size(); ++i) first[i] = static_cast<std::int32_t>(i);
  const auto root = [&](std::int32_t i) {
    while (first[static_cast<std::size_t>(i)] != i) {
      std::int32_t& parent = first[static_cast<std::size_t>(i)];
      parent = first[static_cast<std::size_t>(parent)];
      i = parent;
    }
    return i;
  };
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      require(triangles(t, k) >= 0 && triangles(t, k) < num_points, "triangles", "indices of the points",
              triangles(t, k));
    }
    for (int k = 1; k < 3; ++k) {
      const auto [low, high] = std::minmax({root(triangles(t, 0)), root(triangles(t, k))});
      first[static_cast<std::size_t>(high)] = low;
    }
  }
  std::int32_t num_parts = 0;
  PointNumbers parts(num_points);
  for (std::int32_t i = 0; i < num_points; ++i) {
    const std::int32_t before = root(i);
    parts[i] = before == i ? num_parts++ : parts[before];
  }
  return parts;
}

}  // namespace nacre
