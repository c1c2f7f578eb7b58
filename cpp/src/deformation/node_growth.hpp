// New surface gets nodes, and its points are bound to the nearest.
#pragma once

#include <cstdint>
#include <vector>

#include "deformation/warp_field.hpp"

namespace nacre {

// The model as it is at a frame; its points from field.bindings.size() on are new.
struct GrownSurface {
  const std::vector<Eigen::Vector3f>& points;
  const std::vector<Eigen::Vector3f>& normals;
  const std::vector<float>& spacings;          // of the new points, to their neighbours [m]
  const std::vector<std::int32_t>& last_seen;  // of all points
  std::int32_t frame;
  double spacing;  // where the points are densest [m]
};

// Adds nodes along the new surface, and bindings of its points: as far apart as field.node_spacing where points are
// densest, else farther by as much as points are. Distances along the surface are the shortest ways over neighbouring
// points.
void grow(WarpField& field, const GrownSurface& surface);

}  // namespace nacre
