// Where is the camera that sees an object on a plane, when the object may have turned by any angle? Plane and normal
// are seen in every view: of the six unknowns three are left, the angle and the place on the plane.
#pragma once

#include <vector>

#include "nacre/fusion.hpp"
#include "registration/icp.hpp"
#include "tracking/object_view.hpp"

namespace nacre {

struct PlaneFit {
  IcpResult alignment;       // world_from_camera as target_from_source
  double consistency = 0.0;  // with the views: what agrees, of that and what they see through
};

// The best motion that keeps the plane, or none; with rivals also where the frame fits in several places.
std::vector<PlaneFit> fits_on_plane(const PointModel& model, const std::vector<ObjectView>& views,
                                    const ObjectView& frame, const Camera& camera, const AlignOptions& options,
                                    bool with_rivals);

}  // namespace nacre
