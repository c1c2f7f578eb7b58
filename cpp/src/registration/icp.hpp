// Iterative closest point with a prepared target.
#pragma once

#include <limits>

#include "registration/correspondences.hpp"
#include "registration/scale_check.hpp"

namespace nacre {

struct IcpResult : AlignResult {
  double residual_ratio = std::numeric_limits<double>::quiet_NaN();  // residuals to the largest they may be, rms
  double extent = 1.0;                                               // in units of which weak directions turn [m]
  Matrix6 shape_information = Matrix6::Zero();                       // the part of it on which normals agree
  double signal = infinity<double>;                                  // see IcpStep
  Vector6 weakest = Vector6::Zero();                                 // see IcpStep
  double weakest_part = infinity<double>;                            // see IcpStep
  WeakTest weak_test;                                                // by which directions are weak
  double normal_information = 0.0;                                   // see normal_information
  double off_planes = 0.0;                                           // see share_off_planes
  double residual_sigmas =
      std::numeric_limits<double>::quiet_NaN();  // their scale, in standard deviations of the source
  double num_independent = 0.0;                  // pairs, were their residuals independent
  double misfit = 0.0;  // what neighbouring residuals have in common, by what noise and resolution explain, rms
  SizeDifference size_difference;  // by which the source would have to grow to fit better
};

// align with a prepared target.
IcpResult align_to(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options);
// The same, where weak directions stay as they are in every step,
IcpResult align_held(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options,
                     const WeakTest& weak_test);
// or where the source only moves along some directions.
IcpResult align_along(const TwistBasis& directions, const IcpTarget& target, const IcpSource& source,
                      const Pose& initial, const AlignOptions& options);
// A turn about a plane's normal (of the target frame, unit length), and shifts along the plane.
TwistBasis motions_on_plane(const Eigen::Vector3d& normal);

// Of residuals in the order of space, 1 or more: the variance of the sum of neighbours, by what it were if they were
// independent (of clusters: Kish 1965).
double design_effect(const std::vector<double>& residuals);

// Weights relative to the median pair's; with `robust` also robust ones (Geman and McClure) of the whitened residuals,
// whose scale is their median absolute value but at least `floor` [m]. Returns that scale [m].
double weight_pairs(std::vector<Pair>& pairs, Metric metric, bool robust, double floor);

}  // namespace nacre
