// The normal equations of pairs of points.
#pragma once

#include <vector>

#include "registration/pair.hpp"

namespace nacre {

// The normal equations of the linearised residuals, and what the closed-form point-to-point solution needs.
struct NormalEquations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  Matrix6 chance = Matrix6::Zero();                      // the part of the hessian that noise in the normals feigns
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // sum of w q~ p~^T

  NormalEquations& operator+=(const NormalEquations& other) {
    hessian += other.hessian;
    gradient += other.gradient;
    chance += other.chance;
    covariance += other.covariance;
    return *this;
  }
};

// Of the residuals, weighted by the given member. Unknowns: rotation times extent, translation of the centre. About the
// centroids of the p and the q, rotation and translation are as independent as they can be.
//
// With rows c(n) for a normal n, normals n +- d of the two points whose errors are independent agree on
// c(n + d) c(n - d)^T, symmetrised c(n) c(n)^T - c(d) c(d)^T: noise cancels there and not in the hessian.
NormalEquations normal_equations(const std::vector<Pair>& pairs, Metric metric, double Pair::*weight,
                                 const Eigen::Vector3d& p_mean, const Eigen::Vector3d& q_mean, double extent,
                                 int num_threads);

}  // namespace nacre
