// What pixels err by again and again lies still in the image, and looks like shape to a camera that has not moved.
#pragma once

#include "region/coarse_frame.hpp"
#include "registration/icp.hpp"

namespace nacre {

// Whether a frame sees with so nearly the pixels of one before that errors of neighbours, which are alike, may hold it.
bool may_stick(const CoarseFrame& cells, const Pose& before_from_now);

// Holds what noise may feign: directions of which the shapes tell less than this signal.
void hold_feigned(const IcpTarget& target, const IcpSource& source, const AlignOptions& options, double least_signal,
                  IcpResult& result);

}  // namespace nacre
