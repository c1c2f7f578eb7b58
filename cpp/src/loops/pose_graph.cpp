#include "loops/pose_graph.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "base/se3.hpp"
#include "loops/limits.hpp"

namespace nacre {
namespace {

struct Residual {
  Vector6 value;
  Matrix6 by_from, by_to;  // its derivatives, for motions in the nodes' own frames
};

Residual residual_of(const PoseEdge& edge, const std::vector<Pose>& poses) {
  const Pose from_to = poses[static_cast<std::size_t>(edge.from)].inverse() * poses[static_cast<std::size_t>(edge.to)];
  Residual residual;
  residual.value = log_motion(edge.from_from_to.inverse() * from_to);
  // The inverse of the right Jacobian, to second order (Sola, Deray and Atchuthan 2018).
  Matrix6 ad = Matrix6::Zero();
  ad.topLeftCorner<3, 3>() = ad.bottomRightCorner<3, 3>() = cross_matrix(residual.value.head<3>());
  ad.bottomLeftCorner<3, 3>() = cross_matrix(residual.value.tail<3>());
  residual.by_to = Matrix6::Identity() + 0.5 * ad + ad * ad / 12.0;
  residual.by_from = -residual.by_to * adjoint(from_to.inverse());
  return residual;
}

}  // namespace

int PoseGraph::add_node(const Pose& world_from_node, bool is_fixed) {
  const bool stays = is_fixed || poses_.empty();
  poses_.push_back(world_from_node);
  unknowns_.push_back(stays ? -1 : num_unknowns_);
  if (!stays) num_unknowns_ += 6;
  return num_nodes() - 1;
}

void PoseGraph::add_edge(const PoseEdge& edge) { edges_.push_back(edge); }

void PoseGraph::measure_edges() {
  for (PoseEdge& edge : edges_) {
    edge.from_from_to =
        poses_[static_cast<std::size_t>(edge.from)].inverse() * poses_[static_cast<std::size_t>(edge.to)];
  }
}

bool PoseGraph::has_fixed() const { return num_unknowns_ < 6 * (num_nodes() - 1); }

double PoseGraph::squared_error(std::size_t i, const std::vector<Pose>& poses) const {
  const PoseEdge& edge = edges_[i];
  const Pose from_to = poses[static_cast<std::size_t>(edge.from)].inverse() * poses[static_cast<std::size_t>(edge.to)];
  const Vector6 error = log_motion(edge.from_from_to.inverse() * from_to);
  return error.dot(edge.information * error);
}

double PoseGraph::cost(const std::vector<Pose>& poses, const std::vector<double>& weights) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < edges_.size(); ++i) sum += weights[i] * squared_error(i, poses);
  return sum;
}

bool PoseGraph::step(const std::vector<double>& weights, double& damping, double& cost_now) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(num_unknowns_);
  const auto add_block = [&](int row, int column, const Matrix6& block) {
    if (row < 0 || column < 0 || row < column) return;  // the lower triangle
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {
        if (row + r >= column + c) entries.emplace_back(row + r, column + c, block(r, c));
      }
    }
  };
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const PoseEdge& edge = edges_[i];
    const int from = unknowns_[static_cast<std::size_t>(edge.from)], to = unknowns_[static_cast<std::size_t>(edge.to)];
    const Residual residual = residual_of(edge, poses_);
    const Matrix6 from_weighted = residual.by_from.transpose() * (weights[i] * edge.information);
    const Matrix6 to_weighted = residual.by_to.transpose() * (weights[i] * edge.information);
    if (from >= 0) gradient.segment<6>(from) += from_weighted * residual.value;
    if (to >= 0) gradient.segment<6>(to) += to_weighted * residual.value;
    add_block(from, from, from_weighted * residual.by_from);
    add_block(to, to, to_weighted * residual.by_to);
    add_block(from, to, from_weighted * residual.by_to);
    add_block(to, from, to_weighted * residual.by_from);
  }
  Eigen::SparseMatrix<double> hessian(num_unknowns_, num_unknowns_);
  hessian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd diagonal = hessian.diagonal();

  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
  solver.analyzePattern(hessian);
  for (; damping < 1e8; damping *= 10.0) {
    Eigen::SparseMatrix<double> damped = hessian;
    damped.diagonal() = diagonal * (1.0 + damping) + Eigen::VectorXd::Constant(num_unknowns_, 1e-12);
    solver.factorize(damped);
    if (solver.info() != Eigen::Success) continue;
    const Eigen::VectorXd motion = -solver.solve(gradient);
    std::vector<Pose> moved = poses_;
    for (std::size_t k = 0; k < moved.size(); ++k) {
      if (unknowns_[k] >= 0) moved[k] = orthonormal(moved[k] * exp_twist(motion.segment<6>(unknowns_[k])));
    }
    const double cost_then = cost(moved, weights);
    if (!(cost_then <= cost_now)) continue;
    const bool is_small = cost_now - cost_then <= 1e-9 * cost_now || motion.lpNorm<Eigen::Infinity>() < 1e-10;
    poses_ = moved;
    cost_now = cost_then;
    damping = std::max(1e-9, damping / 10.0);
    return !is_small;
  }
  return false;
}

PoseGraphFit PoseGraph::fit(const std::vector<double>& weights) {
  PoseGraphFit fit;
  fit.weights = weights;
  fit.cost = cost(poses_, weights);
  double damping = 1e-6;
  while (!fit.converged && fit.iterations < loops_limits::most_graph_steps && num_unknowns_ > 0) {
    fit.converged = !step(weights, damping, fit.cost);
    ++fit.iterations;
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    if (weights[i] > 0.0) fit.largest_error = std::max(fit.largest_error, std::sqrt(squared_error(i, poses_)));
  }
  return fit;
}

PoseGraphFit PoseGraph::optimise(double outlier) {
  const std::vector<Pose> before = poses_;
  PoseGraphFit best = fit(std::vector<double>(edges_.size(), 1.0));
  while (best.largest_error > outlier) {
    // Without which loop, of the newest, do the others fit best?
    int num_suspects = 0;
    PoseGraphFit without;
    std::vector<Pose> poses;
    for (std::size_t i = edges_.size(); i-- > 0 && num_suspects < loops_limits::most_suspects;) {
      if (!edges_[i].is_loop || best.weights[i] == 0.0) continue;
      ++num_suspects;
      std::vector<double> weights = best.weights;
      weights[i] = 0.0;
      poses_ = before;
      const PoseGraphFit trial = fit(weights);
      if (!poses.empty() && !(trial.cost < without.cost)) continue;
      without = trial;
      poses = poses_;
    }
    if (poses.empty()) break;
    best = without;
    poses_ = poses;
  }
  return best;
}

}  // namespace nacre
