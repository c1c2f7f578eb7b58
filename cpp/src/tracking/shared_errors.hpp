// What pixels err by again and again lies still in the image, and looks like shape to a camera that has not moved.
#pragma once

#include "region/coarse_frame.hpp"
#include "registration/icp.hpp"

namespace nacre {

// Whether a frame sees with about the pixels that one before saw with, so that what these err by may hold it.
bool may_stick(const CoarseFrame& cells, const Pose& before_from_now);

// Holds what noise may feign: directions of which the shapes tell less than this signal.
void hold_feigned(const IcpTarget& target, const IcpSource& source, const AlignOptions& options, double least_signal,
                  IcpResult& result);

}  // namespace nacre
