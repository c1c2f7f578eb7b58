// Does a frame look like the model where it fits it?
#pragma once

#include "depth/depth_view.hpp"
#include "registration/acceptance.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {

// Brightness of frame and model, compared within squares of `side` pixels of the image: what is darker there than what
// is around it is so in both. Light that falls otherwise, exposure and vignetting change whole squares, and do not
// count.
//
// Each square k that shows enough of the model tells a correlation r_k, lowered where it is smoother than most; their
// agreement is mean(r) / rms(r): its sign alone counts, whatever the texture. Nothing where either side has no colours.
Likeness likeness(const PointsInView& model, const DepthView& view, const Pose& world_from_camera, const Camera& camera,
                  const VisibilityMargin& margin, int side);

}  // namespace nacre
