// ICP of a cloud that may only turn about a plane's normal and move along the plane.
#pragma once

#include "icp_target.hpp"

namespace nacre {

// A turn about the normal of a plane (unit length) through a point, and a shift across it.
struct PlaneMotion {
  Eigen::Vector3d normal, center;

  // How a residual changes with angle and shift.
  Eigen::Vector3d row(const Pair& pair) const;
  Pose apply(const Eigen::Vector3d& angle_and_shift) const;
};

// Weights of Geman and McClure 1985, scaled by the median residual but at least by floor [m].
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
