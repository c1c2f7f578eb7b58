// Colour decides what shape leaves open: the directions of a pose that geometry does not determine.
#pragma once

#include "registration/color_field.hpp"
#include "registration/icp.hpp"

namespace nacre {

// Continues a registration that has weak directions: moves the source along them until the brightness of the matched
// points agrees, and brings it back onto the surface after each step. Directions that the brightness determines are no
// longer weak; along the others, and where too few points have one, the pose stays as it was. What geometry determines
// is never left to colour. Gain and offset between the two brightnesses are found along the way.
IcpResult determine_by_color(const IcpTarget& target, const IcpSource& source, const BrightCloud& target_colors,
                             const BrightCloud& source_colors, const IcpResult& geometric, const AlignOptions& options);

}  // namespace nacre
