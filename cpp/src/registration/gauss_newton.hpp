// Gauss-Newton along some directions of a pose, over rows that anything may provide: brightnesses, outlines.
#pragma once

#include <vector>

#include "registration/icp.hpp"

namespace nacre {

// A residual of a pair, and how it changes with the place of the point that moves.
struct MotionRow {
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();                   // of the point about the center of the motion [m]
  Eigen::Vector3d target_gradient = lever, source_gradient = lever;  // as either side has it
  Eigen::Vector3d gradient = lever;                                  // of both: second-order minimisation (Malis 2004)
  double residual = 0.0, weight = 1.0;
};

// The step along a basis: a twist, its rotation in units of the extent [m]. damping: added to the Hessian's diagonal,
// for each unit of weight.
Vector6 gauss_newton_step(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent, double damping);

// Information on the directions of a basis that source and target agree on: noise cancels, as it does among normals
// (registration/normal_equations.hpp). The residuals' weights are in units of scale^2.
Eigen::MatrixXd agreed_information(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent,
                                   double scale);

// Adds what the rows know of the directions of a basis, their residuals being as noisy as given.
void add_information(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent, double noise,
                     Matrix6& information);

// Brings a pose that was moved along its weak directions back onto the surface. False where too little matches there.
bool return_to_surface(const IcpTarget& target, const IcpSource& source, const AlignOptions& held, IcpResult& result);

}  // namespace nacre
