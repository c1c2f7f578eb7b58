// One step of ICP: the motion that reduces the residuals of given pairs, and what the pairs know about the pose.
#pragma once

#include <limits>
#include <vector>

#include "nacre/registration.hpp"

namespace nacre {

// A source point p, already moved, and the target point q that it is matched with.
struct Pair {
  Eigen::Vector3d p, q;
  Eigen::Vector3d normal;           // direction along which the residual counts; not used by point_to_point
  Eigen::Vector3d half_difference;  // of the two points' normals; NaN where only one is known
  double weight;
  double agreement = 1.0;  // the part of the weight that says how well the two points match, at most 1
  double largest_residual = std::numeric_limits<double>::infinity();  // that a match may have [m]
};

inline double residual(const Pair& pair, Metric metric) {
  const Eigen::Vector3d difference = pair.p - pair.q;
  return metric == Metric::point_to_point ? difference.norm() : difference.dot(pair.normal);
}

struct IcpStep {
  Pose motion = Pose::Identity();  // p <- motion * p
  double size = 0.0;               // how far the motion moves the pairs, root mean square [m]
  double reduction = 0.0;          // of the weighted squares, as far as they are linear [m^2]
  double rmse = 0.0;               // of the residuals before the motion [m]
  double variance = 0.0;           // weighted mean of the squared residuals before the motion [m^2]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Matrix6 hessian = Matrix6::Zero();  // of half the weighted squares, for a twist (rotation, translation) about center
  Matrix6 shape = Matrix6::Zero();    // what the normals of both sides agree on of the hessian
  Eigen::Matrix<double, 6, Eigen::Dynamic> weak_directions;  // scaled unit twists about center
};

// What the normals of a source and of the target tell about each other, for each pair: their mutual information, were
// they Gaussian [nats]. Large where they vary together over the surface; nothing on a plane, however well it fits.
double normal_information(const std::vector<Pair>& pairs, Metric metric);

// Directions in which the normals of source and target agree on less information than weak_threshold, per pair that
// agrees and with rotations in units of the pairs' extent, do not move: what a shape leaves open does not depend on how
// well its parts are measured.
IcpStep solve_step(const std::vector<Pair>& pairs, Metric metric, double weak_threshold, int num_threads);

}  // namespace nacre
