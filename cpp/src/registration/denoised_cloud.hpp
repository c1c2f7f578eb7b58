// Some of a cloud's points with less noise than they were measured with.
#pragma once

#include "nacre/global_registration.hpp"

namespace nacre {

struct DenoisedCloud {
  // Each point is moved along its normal to the mean of its neighbours. There are no normals where nobody knows on
  // which side of the surface they belong.
  Points points, normals;
  double noise = 0.0;  // that is left [m], with what the surface bends between neighbours

  // A cloud that is not noisy, or whose points are thin already, stays as it is.
  DenoisedCloud(const GlobalCloud& cloud, const GlobalAlignOptions& options, bool is_noisy);
};

}  // namespace nacre
