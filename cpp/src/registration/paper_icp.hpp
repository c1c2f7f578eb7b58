// The registration of Blackburn, Kubacki and Stratton 2010.
#pragma once

#include "registration/icp.hpp"

namespace nacre {

// Point to plane: every iteration draws sample_fraction of the source anew, pairs each point with its nearest target
// point and rejects pairs whose target point has no normal (NaN), that are max_distance or more apart along it, or
// whose normals differ by more than max_angle. The result is the pose whose pairs had the least RMSE; the last pose
// without keep_best.
IcpResult align_as_in_paper(const AlignCloud& source, const AlignCloud& target, const Pose& initial,
                            const AlignOptions& options);

}  // namespace nacre
