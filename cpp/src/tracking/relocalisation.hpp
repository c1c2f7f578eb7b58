// Where may a camera be that has been lost? Candidates, found with a few points of its frame.
#pragma once

#include <optional>
#include <vector>

#include "nacre/fusion.hpp"
#include "registration/correspondences.hpp"

namespace nacre {

// The guesses (world_from_camera) on which most agrees after a short registration of a few points of the frame to the
// model, best first: few enough to be registered in full. Of all of them fewer points show which to try with more. With
// the depth of what the frame shows [m] no two are the same view of it.
std::vector<Pose> most_promising(const AlignCloud& model, const IcpSource& source, const std::vector<Pose>& guesses,
                                 const AlignOptions& options, double depth = 0.0);

// Where a frame fits the model, wherever the camera is: in one place, or none; with rivals also where it fits in
// several about as well. `source` holds points of the frame. Takes some tenths of a second.
std::vector<Pose> fits_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options,
                                bool with_rivals);

}  // namespace nacre
