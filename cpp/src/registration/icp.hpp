// Iterative closest point with a prepared target.
#pragma once

#include <limits>

#include "registration/correspondences.hpp"
#include "registration/scale_check.hpp"

namespace nacre {

struct IcpResult : AlignResult {
  double residual_ratio = std::numeric_limits<double>::quiet_NaN();  // residuals to the largest they may be, rms
  Matrix6 shape_information = Matrix6::Zero();                       // the part of it on which normals agree
  double normal_information = 0.0;                                   // see normal_information
  double misfit = 0.0;  // what neighbouring residuals have in common, by what noise and resolution explain, rms
  SizeDifference size_difference;  // by which the source would have to grow to fit better
};

// align with a prepared target. Held: directions that the pairs do not determine stay as they are in every step.
IcpResult align_to(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options);
IcpResult align_held(const IcpTarget& target, const IcpSource& source, const Pose& initial,
                     const AlignOptions& options);

}  // namespace nacre
