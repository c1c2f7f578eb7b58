// Outlines decide what shape leaves open: where a flat surface ends shows how it lies in its own plane.
#pragma once

#include "outlines/occluding_edges.hpp"
#include "registration/icp.hpp"

namespace nacre {

// What two cameras saw, with the outlines that they saw, each in its camera's frame.
struct OutlinePair {
  const Camera& camera;
  const DepthView& before;
  std::vector<OutlinePoint> target, source;
  const Values& depth;  // of each pixel of the source [m]
  double noise;         // of a pixel [m]
};

// Continues a registration that has weak directions: moves the source along them until its outline lies on the one seen
// before (Choi, Trevor and Christensen 2013), and brings it back onto the surface. Directions that outlines of
// different orientation determine are no longer weak; along the others, and where the outlines disagree, the pose stays
// as it was.
IcpResult determine_by_outline(const IcpTarget& target, const IcpSource& source, const OutlinePair& outlines,
                               const IcpResult& geometric, const AlignOptions& options);

}  // namespace nacre
