// Where two views of one scene conflict: beside what moves.
#pragma once

#include <vector>

#include "depth/depth_view.hpp"

namespace nacre {

// Of oriented points, those that a sight saw through. sigma: of the points [m], or none; margin: of a surface [m].
Points seen_through(const PointsRef& points, const PointsRef& normals, const Values& sigma, const DepthView& sight,
                    const Camera& camera, double margin);
// The same of some pixels of a view.
Points seen_through(const DepthView& view, const DepthView& sight, const Camera& camera, double margin);

// The surroundings of conflicts that crowd, as they do beside a thing that moved a little between the views.
class ConflictZones {
 public:
  // from: where the camera is.
  ConflictZones(const Points& conflicts, const Eigen::Vector3d& from);
  bool empty() const { return zones_.empty(); }
  bool include(const Eigen::Vector3f& point) const;

 private:
  struct Zone {
    Eigen::Vector3f center;
    float squared_radius;  // [m^2]
  };
  std::vector<Zone> zones_;
};

}  // namespace nacre
