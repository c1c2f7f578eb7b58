// How bright a frame's colours are beside the model's.
#pragma once

#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// By what a frame's colours are to be multiplied, channel by channel, to be as the model's: the median over points that
// both show, as exposure and white balance change the whole image alike. 1 where too few are known.
Eigen::Vector3f color_gain(const PointModel& model, const RegisteredFrame& now, double spacing);

}  // namespace nacre
