// ICP of a cloud that may only turn about a plane's normal and move along the plane.
#pragma once

#include "registration/icp.hpp"
#include "registration/motion_basis.hpp"

namespace nacre {

// Robust weights, scaled by the median residual but at least by floor [m].
void weight_robustly(std::vector<Pair>& pairs, double floor);

struct PlaneGates {
  double first, last;  // [m]
  int max_iterations;
  std::int64_t num_samples;
};

// The motions keep the plane: they turn about `normal` (of the target frame, unit length), and move across it.
IcpResult align_on_plane(const IcpTarget& target, const IcpSource& source, const Pose& initial,
                         const Eigen::Vector3d& normal, const PlaneGates& gates);

}  // namespace nacre
