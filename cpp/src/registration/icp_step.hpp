// One step of ICP: the motion that reduces the residuals of given pairs, and what the pairs know about the pose.
#pragma once

#include <vector>

#include "nacre/registration.hpp"
#include "registration/pair.hpp"

namespace nacre {

// Twists, rotations in units of an extent, one a column: directions of a pose.
using TwistBasis = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;

// Which directions are weak, and do not move: those of which the normals of source and target agree on less information
// than this, per pair that agrees and with rotations in units of the pairs' extent, since what a shape leaves open does
// not depend on how well its parts are measured; those of which it is less than so many times what noise in them
// feigns; and those of which something else tells more: information as if of residuals of these pairs, per pair, for a
// twist (rotation [rad], translation [m]) about their center.
struct WeakTest {
  double least_information = 0.0;  // 0: none is weak
  double least_signal = 0.0;
  Matrix6 told_otherwise = Matrix6::Zero();
};

// What the next step needs to know of the one before, to be as long as it should be.
struct StepBefore {
  Vector6 twist = Vector6::Zero();  // before it was made longer
  double length = 1.0;              // times which it was taken
};

struct IcpStep {
  Pose motion = Pose::Identity();  // p <- motion * p
  double size = 0.0;               // how far the motion moves the pairs, root mean square [m]
  double reduction = 0.0;          // of the weighted squares, as far as they are linear [m^2]
  double rmse = 0.0;               // of the residuals before the motion [m]
  double variance = 0.0;           // weighted mean of the squared residuals before the motion [m^2]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double extent = 1.0;                // of the pairs about it, root mean square [m]
  Matrix6 hessian = Matrix6::Zero();  // of half the weighted squares, for a twist (rotation, translation) about center
  Matrix6 shape = Matrix6::Zero();    // what the normals of both sides agree on of the hessian
  // The information that normals agree on, by what noise in them feigns, in the direction where that is least.
  double signal = infinity<double>;
  // That direction: a twist (rotation [rad], translation [m]) about center, that moves the pairs by some 1 m;
  Vector6 weakest = Vector6::Zero();
  double weakest_part = infinity<double>;  // and the information along it, per pair that agrees
  TwistBasis weak_directions;              // about center
};

// What the normals of a source and of the target tell about each other, for each pair: their mutual information, were
// they Gaussian [nats]. Large where they vary together over the surface; nothing on a plane, however well it fits.
double normal_information(const std::vector<Pair>& pairs, Metric metric);

// Weak directions do not move. Where `along` has directions, the motion has no others. Where the step before is given,
// the motion is as much longer as that should have been (base/step_length.hpp), and takes its place.
IcpStep solve_step(const std::vector<Pair>& pairs, Metric metric, const WeakTest& test, const TwistBasis& along,
                   int num_threads, StepBefore* before = nullptr);

}  // namespace nacre
