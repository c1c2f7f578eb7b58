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
};

// Adds nodes a spacing apart along the new surface, farther where its points are, and bindings of its points. Distances
// along the surface are the shortest ways over neighbouring points.
void grow(WarpField& field, const GrownSurface& surface);

}  // namespace nacre
