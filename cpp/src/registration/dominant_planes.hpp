// What matches tell beyond a few planes. Any three planes fit any other three that meet at the same angles, as corners
// of rooms and boxes do, and determine the whole pose: that they fit says nothing.
#pragma once

#include <vector>

#include "registration/pair.hpp"

namespace nacre {

// The part of the pairs whose targets lie off the three planes that hold most of them, farther than noise explains:
// than four times the residuals, root mean square, in largest residuals.
double share_off_planes(const std::vector<Pair>& pairs, double residual_ratio);

}  // namespace nacre
