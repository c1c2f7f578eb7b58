// Where may a camera be that has been lost?
#pragma once

#include <optional>

#include "nacre/fusion.hpp"
#include "registration/correspondences.hpp"

namespace nacre {

// Where a frame fits the model, wherever the camera is: none where it fits nowhere, or in several places about as well.
// `source` holds points of the frame. Takes some tenths of a second.
std::optional<Pose> fit_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options);

}  // namespace nacre
